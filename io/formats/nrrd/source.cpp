// NRRD volumes and samples without a header, from files.
#include <fmt/format.h>

#include <optional>
#include <utility>

#include "io/errors/errors.h"
#include "io/formats/nrrd/header.h"
#include "io/formats/nrrd/text_header.h"
#include "io/metadata/rescale.h"
#include "io/samples/file_samples.h"

namespace tagrid {
namespace {

constexpr TextHeaderFormat nrrd = {
    .name = "NRRD",
    .most_bytes = max_nrrd_header_bytes,
    .is_last = [](std::string_view line) { return line == "\n" || line == "\r\n"; },
    .plain = plain_nrrd_header};

/// Adds what is unusual about the header to `facts`.
NrrdHeader read_header(FileBytes& file, SourceFacts& facts) {
  const std::string text = read_header_text(file, nrrd);
  try {
    ForeignNrrdHeader header = foreign_nrrd_header(text);
    const auto said = [&](const std::string& sentence) {
      return fmt::format("{}: {}", file.name(), sentence);
    };
    for (const std::string& sentence : header.warnings) facts.warnings.push_back(said(sentence));
    for (const std::string& sentence : header.not_understood) facts.not_understood.push_back(said(sentence));
    return parse_nrrd_header(header.text);
  } catch (const BrokenInput& broken) {
    throw BrokenInput(file.name() + ": " + broken.what());
  }
}

/// Checks the user's description of an NRRD file against its header.
void check_against(const RawDescription& raw, const NrrdHeader& header, const std::string& name) {
  const VolumeInfo& info = header.info;
  const std::string both = fmt::format("{}: its NRRD header says {}, but its description says {}", name,
                                       described(info.dims, info.type), described(raw.dims, raw.type));
  if (raw.dims != info.dims) throw BrokenInput(both);
  if (raw.type != info.type) throw UsageError(both);
  if (raw.big_endian && size_of(info.type) > 1 && *raw.big_endian != header.big_endian)
    throw UsageError(
        fmt::format("{}: its NRRD header says endian {}", name, header.big_endian ? "big" : "little"),
        Problem::endian_differs);
}

void skip_lines(FileBytes& file, std::int64_t count) {
  for (std::int64_t i = 0; i < count; ++i) {
    std::string line;
    if (!file.read_line(line, max_nrrd_header_bytes) || line.empty())
      throw BrokenInput("{}: its header says to skip {} lines, but it has fewer", file.name(), count);
  }
}

/// The byte at which uncompressed samples of `info` begin, after the lines that are skipped.
std::uint64_t start_of_samples(const FileBytes& file, const NrrdHeader& header, const VolumeInfo& info) {
  if (header.byte_skip >= 0) return file.position() + static_cast<std::uint64_t>(header.byte_skip);
  if (!file.size())
    throw BrokenInput(file.name() + ": byte skip -1 (samples at the end) cannot be read from a pipe");
  const std::uint64_t bytes = *sample_bytes(info.dims, info.type);
  return *file.size() - file.position() >= bytes ? *file.size() - bytes : file.position();
}

/// The samples of `facts` in a file, stored as the header at `path` says. The file is where its lines begin.
std::unique_ptr<VolumeSource> open_samples(std::unique_ptr<FileBytes> file, const NrrdHeader& header,
                                           SourceFacts facts, std::uint64_t header_bytes,
                                           const std::string& path) {
  SamplesPlace place{.start = 0, .big_endian = header.big_endian, .header_bytes = header_bytes};
  skip_lines(*file, header.line_skip);
  if (header.encoding != NrrdHeader::Encoding::raw) {
    place.start = file->position();
    // One of several data files has no header of its own: all its bytes before the samples are kept as they are.
    PlainHeader plain;
    if (facts.files.front() == path) {
      const auto end = facts.files.size() == 1 ? std::optional(place.start) : std::nullopt;
      plain = [path, end] { return plain_header(path, nrrd, end); };
    }
    return compressed_samples(
        std::move(facts), std::move(file), place, static_cast<std::uint64_t>(header.byte_skip),
        std::move(plain),
        header.encoding == NrrdHeader::Encoding::bzip2 ? Compression::bzip2 : Compression::gzip);
  }
  place.start = start_of_samples(*file, header, facts.info);
  allow_more(*file, place, facts);
  return plain_samples(std::move(facts), std::move(file), place);
}

}  // namespace

std::unique_ptr<VolumeSource> open_nrrd(std::unique_ptr<FileBytes> file, const std::string& path,
                                        const SourceDescription& source) {
  const std::string header_name = file->name();
  SourceFacts facts;
  facts.files = {path};
  NrrdHeader header = read_header(*file, facts);
  if (source.raw) check_against(*source.raw, header, header_name);
  facts.info = header.info;
  if (const std::string doubt = doubt_of_rescale(facts.info.metadata, facts.info.dims.z); !doubt.empty())
    facts.scale_doubt = fmt::format("{}: NRRD header: {}", header_name, doubt);
  facts.rescale = facts.info.metadata.rescale_of_bounds();
  facts.holds_other_bytes = header.line_skip != 0 || header.byte_skip != 0;
  if (header.data_files.empty()) return open_samples(std::move(file), header, std::move(facts), 0, path);
  if (!file->peek(1).empty()) facts.holds_other_bytes = true;  // notes after the header
  const std::vector<std::string> data_files = std::exchange(header.data_files, {});
  if (data_files.size() > 1 && header.encoding != NrrdHeader::Encoding::raw)
    facts.plain_form = [path, is_bzip2 = header.encoding == NrrdHeader::Encoding::bzip2] {
      return PlainForm{is_bzip2 ? "bzip2" : "gzip", {plain_header(path, nrrd, std::nullopt)}, {}};
    };
  return open_data_files(
      nrrd, std::move(facts), path, header_name, file->position(), data_files, source.data_outside,
      [header, path](std::unique_ptr<FileBytes> data, SourceFacts of_file, std::uint64_t header_bytes) {
        return open_samples(std::move(data), header, std::move(of_file), header_bytes, path);
      });
}

std::unique_ptr<VolumeSource> open_raw(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source) {
  const RawDescription& raw = source.raw.value();
  if (!sample_bytes(raw.dims, raw.type))
    throw UsageError(described(raw.dims, raw.type) +
                     ": sizes must be positive, and the volume must be smaller than 2^62 bytes");
  SourceFacts facts{.info = {raw.dims, raw.type},
                    .files = {path},
                    .traits = {},
                    .holds_other_bytes = raw.offset > 0,
                    .headerless = true};
  return plain_samples(std::move(facts), std::move(file),
                       SamplesPlace{raw.offset, raw.big_endian.value_or(false), 0});
}

}  // namespace tagrid
