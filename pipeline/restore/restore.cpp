#include "pipeline/restore/restore.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/files/open_source.h"
#include "io/system/files.h"
#include "io/tag/file.h"
#include "io/text/text.h"
#include "pipeline/decode/decode_run.h"
#include "pipeline/decode/graph.h"
#include "pipeline/threads/threads.h"

namespace tagrid {
namespace {

SampleShape shape_of(const TagHeader& header) { return {header.all_dims(), header.parameters.type}; }

std::uint64_t memory_of_envelope(const TagBricks& file) {
  if (file.sizes().envelope == 0) return 0;
  return memory_of_files(
      envelope_size(file.name(), shape_of(file.header()), file.parameters().is_exact(), file.envelope()));
}

std::string stored_words(const std::string& compression) {
  return compression.empty() ? "not compressed" : fmt::format("compressed ({})", compression);
}

}  // namespace

std::uint64_t memory_of_envelope(const std::string& path) {
  try {
    return memory_of_envelope(TagBricks(open_source(path)));
  } catch (const BrokenInput&) {
    return 0;  // who reads it says what is wrong
  }
}

void look_at_contents(SourceFiles& source, bool exact, int threads) {
  Threads(threads).run([&] {
    oneapi::tbb::parallel_for(std::size_t{0}, source.files.size(),
                              [&](std::size_t number) { look_at_content(source, exact, number); });
  });
}

KeptFiles source_files_of(const TagBricks& file) {
  if (file.sizes().envelope == 0) return {};
  EnvelopeReader reader(file.name(), shape_of(file.header()), file.parameters().is_exact(), file.envelope());
  KeptFiles kept;
  for (EnvelopeFile next; reader.next_file(next);) {
    reader.read_other_bytes(next, [](std::uint64_t, std::span<const std::byte>) {});
    kept.files.push_back(std::move(next));
  }
  kept.compression = reader.compression();
  return kept;
}

SourceComparison compare_source_files(const TagBricks& file, const VolumeSource& original, int threads) {
  SourceComparison result;
  if (file.sizes().envelope == 0) {
    result.difference = "the .tag file keeps no source files";
    return result;
  }
  SourceFiles source = source_files(original.facts());
  const auto [kept, compression] = source_files_of(file);
  if (!source.why_not && source.compression != compression) {
    result.difference = fmt::format("their samples are {}, and were {}", stored_words(source.compression),
                                    stored_words(compression));
    return result;
  }
  result.compression = compression;
  result.has_same_names =
      std::ranges::equal(kept, source.names, {}, [](const EnvelopeFile& then) { return then.name; });
  result.difference = source.why_not.value_or("");
  if (kept.size() != source.names.size())
    result.difference = fmt::format("{} {} encoded, {} {} given", counted(kept.size(), "file"),
                                    kept.size() == 1 ? "was" : "were", source.names.size(),
                                    source.names.size() == 1 ? "was" : "were");
  for (std::size_t i = 0; result.difference.empty() && i < kept.size(); ++i) {
    EnvelopeFile& now = source.files[i];
    if (kept[i].size != now.size)
      result.difference = fmt::format("{} has {} bytes instead of {}", now.name, now.size, kept[i].size);
    now.name = kept[i].name;  // another name is no other content
  }
  if (!result.difference.empty()) return result;
  look_at_contents(source, file.parameters().is_exact(), threads);
  // The envelope of the original is compared with that in the file while it is made.
  const NextBlock next_block = file.envelope();
  std::vector<std::byte> block;
  std::span<const std::byte> kept_bytes;  // what follows in the file, if is_at_end() is false
  const auto is_at_end = [&] {
    while (kept_bytes.empty() && next_block(block)) kept_bytes = block;
    return kept_bytes.empty();
  };
  result.is_same = true;
  std::size_t different = 0;
  const auto compare = [&](std::span<const std::byte> bytes) {
    while (result.is_same && !bytes.empty()) {
      const std::size_t n = is_at_end() ? 0 : std::min(bytes.size(), kept_bytes.size());
      result.is_same = n > 0 && std::ranges::equal(bytes.first(n), kept_bytes.first(n));
      bytes = bytes.subspan(n);
      kept_bytes = kept_bytes.subspan(n);
    }
  };
  write_envelope(source, compare, [&](std::size_t number) {
    if (result.is_same) different = number;
  });
  result.is_same = result.is_same && is_at_end();
  if (!result.is_same)
    result.difference = fmt::format("{} differs from the file that was encoded", source.names[different]);
  return result;
}

void require_same(const SourceComparison& found, const std::string& original) {
  if (!found.is_same) throw BrokenInput("{}: would be restored differently: {}", original, found.difference);
}

Finished<RestoreResult> restore_files(const RestoreRun& run) {
  if (is_folder(run.input)) throw UsageError(run.input + ": is a directory; give a .tag file");
  if (run.input == "-" || (status_of(run.input) && !is_regular_input(run.input)))
    throw UsageError(shown_input(run.input) +
                     ": only a regular file can be restored; save the pipe as one first");
  const auto all = std::make_shared<const TagBricks>(open_source(run.input));
  const TagBricks& file = *all;
  const CodingParameters& parameters = file.parameters();
  if (file.sizes().envelope == 0)
    throw UsageError(
        run.input +
            ": holds no source files: the volume came through a pipe, its files had samples in a "
            "compressed form or more other bytes than are kept, or they were left out on purpose",
        Problem::no_source_files);
  const DecodePlan plan = plan_decoding(parameters, run.resources, DecodeUse::write,
                                        run.resources.memory ? memory_of_envelope(file) : 0);
  const SinkOptions options{.overwrite = run.overwrite, .like = attributes_of(run.input)};
  const auto files =
      std::make_shared<RestoredFiles>(info_of_all(file.header()), run.input, run.folder, options);
  EnvelopeReader envelope(file.name(), shape_of(file.header()), parameters.is_exact(), file.envelope());
  while (files->make_next(envelope))
    if (run.exported)
      files->rewrite_last(
          exported_dicom_file(FileSource(files->staged_last()), files->files().back().name, *run.exported));
  ProgressWatch watch(run.progress, sample_bytes(file.header().all_dims(), parameters.type).value());
  for (int number = 0; number < file.header().volumes; ++number) {
    const auto volume = volume_in(all, number);
    RowOutput output(*files, std::nullopt, run.folder, number * Box::of_size(parameters.dims).count());
    BricksInOrder bricks(*volume);
    decode({parameters, plan.budget, BrickRows::all(parameters.bricks())}, bricks, output, watch);
  }
  files->check();
  TagIndex index = file.index();
  index.total = statistics_of_all(file);
  return {{file.header(),
           std::move(index),
           file.sizes().file,
           files->bytes_written(),
           {files->files(), envelope.compression()}},
          files};
}

}  // namespace tagrid
