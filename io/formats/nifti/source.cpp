// NIfTI volumes from files.
#include <fmt/format.h>

#include <filesystem>

#include "io/errors/errors.h"
#include "io/files/compressed_bytes.h"
#include "io/formats/nifti/header.h"
#include "io/samples/data_files.h"
#include "io/samples/file_samples.h"
#include "io/system/files.h"
#include "io/volume/one_of_volumes.h"
#include "io/volume/volume_source.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

NiftiHeader read_header(FileBytes& file) {
  try {
    return parse_nifti_header(begins_gzip(file) ? beginning_of_gzip(file, max_nifti_header_bytes)
                                                : std::string(file.peek(max_nifti_header_bytes)));
  } catch (const BrokenInput& error) {
    throw BrokenInput(fmt::format("{}: {}", file.name(), error.what()));
  }
}

/// The file of the samples beside a header: scan.img or scan.img.gz beside scan.hdr or scan.hdr.gz.
std::string image_path(const std::string& path, const std::string& name) {
  if (path == "-")
    throw UsageError(name +
                     ": is a NIfTI header, whose samples are in another file; give the header by its name");
  fs::path image = path;
  if (image.extension() == ".gz") image.replace_extension();
  const bool is_upper = image.extension() == ".HDR";
  image.replace_extension(is_upper ? ".IMG" : ".img");
  for (const std::string& candidate : {image.string(), image.string() + ".gz"})
    if (const auto status = status_of(candidate); status && status->is_file()) return candidate;
  throw WorldError(
      fmt::format("{}: is a NIfTI header, but the file of its samples is missing: {}", name, image.string()));
}

/// The file of a header without its samples, which may be compressed, too.
PlainHeader plain_header(const std::string& path) {
  return [path]() -> PlainFile {
    FileBytes file(path);
    if (begins_gzip(file)) return {plain_name(path), true, {PlainPiece::content(0, 0)}};
    return {path, false, {PlainPiece::stretch(0, 0, file.size().value_or(0))}};
  };
}

}  // namespace

std::unique_ptr<VolumeSource> open_nifti(std::unique_ptr<FileBytes> file, const std::string& path,
                                         const SourceDescription& source) {
  const std::string name = file->name();
  NiftiHeader header = read_header(*file);
  const std::optional<std::int64_t> number = wanted_volume(source, name, header.info, header.volumes);
  const std::uint64_t before = header.offset + static_cast<std::uint64_t>(number.value_or(0)) *
                                                   *sample_bytes(header.info.dims, header.info.type);
  SourceFacts facts;
  facts.info = std::move(header.info);
  if (!number) {
    take_all_volumes(facts.info, header.volumes);
    facts.info.metadata.add_pairs(header.pairs_of_volumes);
    facts.volume_names = std::move(header.volume_names);
  }
  facts.files = {path};
  facts.rescale = header.rescale;
  facts.holds_other_bytes = true;  // the header says more than the file that is made
  for (const std::string& warning : header.warnings) facts.warnings.push_back(name + ": " + warning);
  for (const std::string& sentence : header.not_understood)
    facts.not_understood.push_back(name + ": " + sentence);
  if (!header.scale_doubt.empty()) facts.scale_doubt = name + ": " + header.scale_doubt;
  if (header.is_pair) {
    facts.files.push_back(image_path(path, name));
    require_inside(path, {facts.files.back()}, source.data_outside, facts.warnings);
    file = std::make_unique<FileBytes>(facts.files.back());
  }
  const bool is_last = !number || *number + 1 == header.volumes;
  SamplesPlace place{.start = 0, .big_endian = header.big_endian, .may_go_on = !is_last};
  if (begins_gzip(*file))
    return compressed_samples(std::move(facts), std::move(file), place, before,
                              header.is_pair ? plain_header(path) : PlainHeader());
  place.start = before;
  if (is_last) allow_more(*file, place, facts);
  return plain_samples(std::move(facts), std::move(file), place);
}

}  // namespace tagrid
