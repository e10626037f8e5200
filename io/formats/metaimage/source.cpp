// MetaImage volumes from files.
#include <fmt/format.h>

#include <optional>
#include <utility>

#include "io/errors/errors.h"
#include "io/formats/metaimage/header.h"
#include "io/formats/nrrd/text_header.h"
#include "io/samples/file_samples.h"
#include "io/volume/one_of_volumes.h"
#include "io/volume/volume_source.h"

namespace tagrid {
namespace {

constexpr TextHeaderFormat meta_image = {.name = "MetaImage",
                                         .most_bytes = max_meta_image_header_bytes,
                                         .is_last = ends_meta_image_header,
                                         .plain = plain_meta_image_header};

MetaImageHeader read_header(FileBytes& file) {
  const std::string text = read_header_text(file, meta_image);
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
                                           std::uint64_t header_bytes, const std::string& path) {
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
                            [path, end] { return plain_header(path, meta_image, end); });
}

}  // namespace

std::unique_ptr<VolumeSource> open_meta_image(std::unique_ptr<FileBytes> file, const std::string& path,
                                              const SourceDescription& source) {
  const std::string name = file->name();
  MetaImageHeader header = read_header(*file);
  const std::optional<std::int64_t> number = wanted_volume(source, name, header.info, header.volumes);
  const std::uint64_t before =
      static_cast<std::uint64_t>(number.value_or(0)) * *sample_bytes(header.info.dims, header.info.type);
  SourceFacts facts;
  facts.info = header.info;
  if (!number) take_all_volumes(facts.info, std::exchange(header.volumes, 1));
  facts.files = {path};
  facts.rescale = header.rescale;
  for (const std::string& warning : header.warnings) facts.warnings.push_back(name + ": " + warning);
  if (!header.scale_doubt.empty()) facts.scale_doubt = name + ": " + header.scale_doubt;
  facts.holds_other_bytes = true;  // fields of the header are kept, but not the header
  if (header.data_files.empty())
    return open_samples(std::move(file), header, std::move(facts), before, 0, path);
  const std::uint64_t header_bytes = file->position();
  file.reset();
  const std::vector<std::string> data_files = std::exchange(header.data_files, {});
  return open_data_files(
      meta_image, std::move(facts), path, name, header_bytes, data_files, source.data_outside,
      [=](std::unique_ptr<FileBytes> data, SourceFacts of_file, std::uint64_t bytes_of_header) {
        return open_samples(std::move(data), header, std::move(of_file), before, bytes_of_header, path);
      });
}

}  // namespace tagrid
