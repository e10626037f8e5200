#include "io/formats/metaimage/source.h"

#include <fmt/format.h>

#include <optional>
#include <set>

#include "io/errors/errors.h"
#include "io/formats/metaimage/header.h"
#include "io/samples/data_file.h"
#include "io/samples/file_samples.h"
#include "io/samples/joined.h"
#include "io/volume/one_of_several.h"

namespace tagrid {
namespace {

/// The lines of the header. A list of files extends to the end of the file.
std::string read_header_text(FileBytes& file) {
  std::string text;
  for (std::size_t line_start = 0;; line_start = text.size()) {
    if (!file.read_line(text, max_meta_image_header_bytes - text.size()))
      throw BrokenInput(fmt::format("{}: the MetaImage header does not end within {} bytes", file.name(),
                                    max_meta_image_header_bytes));
    const std::string_view line = std::string_view(text).substr(line_start);
    if (line.empty() || ends_meta_image_header(line)) return text;
  }
}

/// The header of a file in its plain form, and what follows it up to byte `end`; nothing: the end of the
/// file.
PlainFile plain_header(const std::string& path, std::optional<std::uint64_t> end) {
  FileBytes file(path);
  const std::string text = read_header_text(file);
  return {path,
          true,
          {PlainPiece::given(plain_meta_image_header(text)),
           PlainPiece::stretch(0, file.position(), end.value_or(file.size().value_or(0)))}};
}

MetaImageHeader read_header(FileBytes& file) {
  const std::string text = read_header_text(file);
  try {
    return parse_meta_image_header(text);
  } catch (const BrokenInput& broken) {
    throw BrokenInput(fmt::format("{}: {}", file.name(), broken.what()));
  }
}

/// The samples of `facts` after `before` others. The file is where its samples begin, or the header before
/// them.
std::unique_ptr<VolumeSource> open_samples(std::unique_ptr<FileBytes> file, const MetaImageHeader& header,
                                           SourceFacts facts, std::uint64_t before,
                                           std::uint64_t header_bytes, const std::string& header_path) {
  const std::uint64_t own = *sample_bytes(facts.info.dims, facts.info.type),
                      bytes = own * static_cast<std::uint64_t>(header.volumes);
  const bool is_last = before + own == bytes;
  SamplesPlace place{.start = file->position(),
                     .big_endian = header.big_endian,
                     .may_go_on = !is_last,
                     .header_bytes = header_bytes};
  if (header.header_size > 0) {
    place.start += static_cast<std::uint64_t>(header.header_size);
  } else if (header.header_size == -1) {
    if (file->size() && *file->size() > bytes) place.start = *file->size() - bytes;
  }
  if (!header.is_compressed) {
    place.start += before;
    if (is_last) allow_more(*file, place, facts);
    return plain_samples(std::move(facts), std::move(file), place);
  }
  const auto end = facts.files.size() == 1 ? std::optional(place.start) : std::nullopt;
  return compressed_samples(std::move(facts), std::move(file), place, before,
                            [header_path, end] { return plain_header(header_path, end); });
}

}  // namespace

std::unique_ptr<VolumeSource> open_meta_image(std::unique_ptr<FileBytes> file, const std::string& path,
                                              const SourceDescription& source) {
  const std::string name = file->name();
  if (source.raw) throw UsageError(name + ": is a MetaImage file", Problem::describes_itself);
  const MetaImageHeader header = read_header(*file);
  const auto number = static_cast<std::uint64_t>(
      number_of_volume(name, source.series, header.volumes, described(header.info.dims, header.info.type)));
  const std::uint64_t before = number * *sample_bytes(header.info.dims, header.info.type);
  SourceFacts facts;
  facts.info = header.info;
  facts.files = {path};
  facts.rescale = header.rescale;
  for (const std::string& warning : header.warnings) facts.warnings.push_back(name + ": " + warning);
  if (!header.scale_doubt.empty()) facts.scale_doubt = name + ": " + header.scale_doubt;
  facts.holds_other_bytes = true;  // fields of the header are kept, but not the header
  if (header.data_files.empty())
    return open_samples(std::move(file), header, std::move(facts), before, 0, path);
  const std::uint64_t header_bytes = file->position();
  file.reset();
  const auto count = static_cast<std::int64_t>(header.data_files.size());
  std::set<std::string> known;  // a file may be named twice
  for (const std::string& data_file : header.data_files)
    if (const std::string data_path = path_of_data_file(path, data_file); known.insert(data_path).second)
      facts.files.push_back(data_path);
  // Two copies of the header, and two of each path.
  for (const std::string& data_path : known)
    facts.traits.memory += 4 * (data_path.size() + 2 * sizeof data_path);
  VolumeInfo part = header.info;
  part.dims.z /= count;
  const auto open = [=](std::int64_t i) {
    const std::string& data_file = header.data_files[static_cast<std::size_t>(i)];
    const std::string data_path = path_of_data_file(path, data_file);
    SourceFacts facts_of_part;
    facts_of_part.info = part;
    facts_of_part.files = {data_path};
    return open_samples(open_data_file(data_path, data_file, name, "MetaImage"), header,
                        std::move(facts_of_part), before, i == 0 ? header_bytes : 0, path);
  };
  if (count > 1) return joined(std::move(facts), count, open);
  const std::string& data_file = header.data_files.front();
  auto data = open_data_file(facts.files.back(), data_file, name, "MetaImage");
  return open_samples(std::move(data), header, std::move(facts), before, header_bytes, path);
}

}  // namespace tagrid
