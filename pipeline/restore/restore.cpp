#include "pipeline/restore/restore.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/files/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/system_call.h"
#include "io/nrrd/geometry.h"
#include "io/tag/file.h"
#include "pipeline/decode/row_decoder.h"
#include "pipeline/decode/row_output.h"
#include "pipeline/memory/plan.h"

namespace tagrid {
namespace {

SampleShape shape_of(const CodingParameters& parameters) { return {parameters.dims, parameters.type}; }

/// Compares an envelope that is being written with the one in a file.
class EnvelopeComparison {
 public:
  explicit EnvelopeComparison(NextBlock next) : next_(std::move(next)) {}

  void compare(std::span<const std::byte> bytes) {
    while (is_same_ && !bytes.empty()) {
      if (position_ == block_.size()) {
        position_ = 0;
        if (!next_(block_)) {
          block_.clear();
          is_same_ = false;
          return;
        }
      }
      const std::size_t n = std::min(bytes.size(), block_.size() - position_);
      is_same_ = std::ranges::equal(bytes.first(n), std::span(block_).subspan(position_, n));
      bytes = bytes.subspan(n);
      position_ += n;
    }
  }
  bool is_same() { return is_same_ && position_ == block_.size() && !next_(block_); }

 private:
  NextBlock next_;
  std::vector<std::byte> block_;
  std::size_t position_ = 0;
  bool is_same_ = true;
};

}  // namespace

bool is_exact(const CodingParameters& parameters) {
  // Fractions of a bound have no effect on integers.
  const double bound =
      is_float_type(parameters.type) ? parameters.max_error : std::floor(parameters.max_error);
  return bound == 0;
}

std::string keep_source_files(const VolumeSource& source, const CodingParameters& parameters, bool keep,
                              const PutBytes& put) {
  if (!keep) return "only the samples were wanted";
  const SourceFiles files = source_files(source.facts());
  if (files.why_not.empty()) write_envelope(files, is_exact(parameters), put);
  return files.why_not;
}

std::vector<EnvelopeFile> source_files_of(const TagBricks& file) {
  if (file.sizes().envelope == 0) return {};
  EnvelopeReader reader(file.name(), shape_of(file.parameters()), is_exact(file.parameters()),
                        file.envelope());
  std::vector<EnvelopeFile> files;
  for (EnvelopeFile next; reader.next_file(next);) {
    reader.read_other_bytes(next, [](std::uint64_t, std::span<const std::byte>) {});
    files.push_back(std::move(next));
  }
  return files;
}

SourceComparison compare_source_files(const TagBricks& file, const VolumeSource& original) {
  SourceComparison result;
  if (file.sizes().envelope == 0) {
    result.difference = "the .tag file keeps no source files";
    return result;
  }
  SourceFiles source = source_files(original.facts());
  const std::vector<EnvelopeFile> kept = source_files_of(file);
  result.has_same_names =
      std::ranges::equal(kept, source.names, {}, [](const EnvelopeFile& then) { return then.name; });
  result.difference = source.why_not;
  if (kept.size() != source.names.size())
    result.difference =
        fmt::format("these are {} files, but {} were encoded", source.names.size(), kept.size());
  for (std::size_t i = 0; result.difference.empty() && i < kept.size(); ++i) {
    EnvelopeFile& now = source.files[i];
    if (kept[i].size != now.size)
      result.difference = fmt::format("{} has {} bytes, and had {} then", now.name, now.size, kept[i].size);
    now.name = kept[i].name;  // another name is no other content
  }
  if (!result.difference.empty()) return result;
  EnvelopeComparison comparison(file.envelope());
  write_envelope(source, is_exact(file.parameters()),
                 [&](std::span<const std::byte> bytes) { comparison.compare(bytes); });
  result.is_same = comparison.is_same();
  if (!result.is_same) result.difference = "they have other bytes than those that were encoded";
  return result;
}

void require_same_source_files(const TagBricks& file, const VolumeSource& original) {
  if (const SourceComparison found = compare_source_files(file, original); !found.is_same)
    throw BrokenInput(
        fmt::format("{}: would be restored differently: {}", original.name(), found.difference));
}

Finished<RestoreResult> restore_files(const RestoreRun& run) {
  if (run.input == "-" || (status_of(run.input) && !is_regular_input(run.input)))
    throw UsageError(run.input +
                     ": source files are restored from a regular file only; write the pipe to one");
  const TagBricks file(std::make_shared<FileSource>(run.input));
  const CodingParameters& parameters = file.parameters();
  if (file.sizes().envelope == 0)
    throw UsageError(
        run.input +
            ": holds no source files: it was encoded from a pipe, from compressed samples or from "
            "files with much else, or they were left out",
        Problem::no_source_files);
  const DecodePlan plan = plan_decoding(parameters, run.resources, DecodeUse::write, 0);
  const SinkOptions options{.overwrite = run.overwrite, .like = attributes_of(run.input)};
  const auto files =
      std::make_shared<RestoredFiles>(volume_info_of(file.header()), run.input, run.folder, options);
  EnvelopeReader envelope(file.name(), shape_of(parameters), is_exact(parameters), file.envelope());
  files->make(envelope);
  RowOutput output(*files, "", run.folder);
  RowDecoder decoder(parameters, plan.budget);
  decoder.decode(
      BrickRows::all(parameters.bricks()), file.bricks_from(0),
      [&](const DecodedRows& rows) { output.write(rows); },
      watch_for(run.progress, sample_bytes(parameters.dims, parameters.type).value()));
  files->check();
  return {{file.header(), file.index(), file.sizes().file, files->bytes_written(), files->files()}, files};
}

}  // namespace tagrid
