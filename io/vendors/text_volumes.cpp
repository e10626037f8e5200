// VGStudio and Nikon: a text describes samples in another file.

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <optional>

#include "io/files/errors.h"
#include "io/files/text.h"
#include "io/nrrd/geometry.h"
#include "io/samples/data_file.h"
#include "io/samples/placed.h"
#include "io/vendors/sections.h"
#include "io/vendors/vendors.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

std::int64_t integer_of(const std::string& file, std::string_view name, std::string_view text) {
  const auto number = whole_number_of(text);
  if (!number)
    throw BrokenInput(fmt::format("{}: {} {} must be a whole number", file, name, tagrid::quoted(text)));
  return *number;
}

/// Three positive numbers; nothing if there are not.
std::optional<std::array<double, 3>> sizes_of(const std::array<std::string_view, 3>& words) {
  std::array<double, 3> sizes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto number = number_of(words[axis]);
    if (!number || !std::isfinite(*number) || *number <= 0) return std::nullopt;
    sizes[axis] = *number;
  }
  return sizes;
}

Geometry spaced(const std::optional<std::array<double, 3>>& spacing, const std::string& unit) {
  Geometry geometry;
  if (!spacing) return geometry;
  geometry.spacing = *spacing;
  geometry.has_spacing = true;
  geometry.units.fill(unit);
  return geometry;
}

void require_size(const std::string& file, const Index3& dims, SampleType type) {
  if (!sample_bytes(dims, type) || !is_volume_size(dims))
    throw BrokenInput(fmt::format("{}: a volume cannot have {} samples", file, described(dims, type)));
}

KeyValues pairs_of(const Sections& sections, const std::string& prefix) {
  KeyValues pairs;
  for (const auto& [key, value] : sections)
    if (!value.empty()) pairs.emplace_back(prefix + key, value);
  return pairs;
}

/// The samples of `info` in a file, from byte `offset` on.
std::unique_ptr<VolumeSource> placed(VolumeInfo info, const std::string& path, const std::string& data_path,
                                     std::uint64_t offset) {
  const std::uint64_t slice = *sample_bytes({info.dims.x, info.dims.y, 1}, info.type);
  const std::int64_t slices = info.dims.z;
  SourceFacts facts{.info = std::move(info), .files = {path, data_path}};
  facts.holds_other_bytes = true;  // the description says more than the file that is made
  return placed_samples(std::move(facts), {{1, offset, slices, slice, false}});
}

SampleType type_of_vgi(const std::string& file, const Sections& sections) {
  const std::string kind = lower_case(required(sections, "file1/datatype", file));
  const std::int64_t bits =
      integer_of(file, "BitsPerElement", required(sections, "file1/bitsperelement", file));
  if (kind == "float" && bits == 32) return SampleType::float32;
  if (kind == "float" && bits == 64) return SampleType::float64;
  const bool is_signed = kind == "signed integer" || kind == "integer";
  if (is_signed || kind == "unsigned integer") {
    if (bits == 8) return is_signed ? SampleType::int8 : SampleType::uint8;
    if (bits == 16) return is_signed ? SampleType::int16 : SampleType::uint16;
    if (bits == 32) return is_signed ? SampleType::int32 : SampleType::uint32;
  }
  throw BrokenInput(fmt::format("{}: samples of type {} with {} bits are not supported", file,
                                tagrid::quoted(std::string_view(kind)), bits));
}

}  // namespace

bool begins_vgi(std::string_view bytes) {
  const std::size_t begin = bytes.find_first_not_of(" \t\r\n");
  return begin != bytes.npos && bytes.substr(begin).starts_with("{volume");
}

std::unique_ptr<VolumeSource> open_vgi(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source) {
  const std::string name = file->name();
  if (source.raw) throw UsageError(name + ": is a VGStudio file", Problem::describes_itself);
  const Sections sections = read_sections(*file);
  const std::string& size = required(sections, "file1/size", name);
  const auto words = words_of(size);
  if (words.size() != 3)
    throw BrokenInput(
        fmt::format("{}: Size {} must be 3 numbers", name, tagrid::quoted(std::string_view(size))));
  const Index3 dims{integer_of(name, "Size", words[0]), integer_of(name, "Size", words[1]),
                    integer_of(name, "Size", words[2])};
  const SampleType type = type_of_vgi(name, sections);
  require_size(name, dims, type);
  if (const auto format = sections.find("file1/fileformat");
      format != sections.end() && lower_case(format->second) != "raw")
    throw BrokenInput(fmt::format("{}: samples in the format {} are not supported", name,
                                  tagrid::quoted(std::string_view(format->second))));
  std::uint64_t offset = 0;
  if (const auto skip = sections.find("file1/skipheader"); skip != sections.end() && !skip->second.empty()) {
    const std::int64_t bytes = integer_of(name, "SkipHeader", skip->second);
    if (bytes < 0) throw BrokenInput(fmt::format("{}: SkipHeader is {}", name, bytes));
    offset = static_cast<std::uint64_t>(bytes);
  }
  std::optional<std::array<double, 3>> spacing;
  if (const auto found = sections.find("geometry/resolution"); found != sections.end())
    if (const auto numbers = words_of(found->second); numbers.size() == 3)
      spacing = sizes_of({numbers[0], numbers[1], numbers[2]});
  const auto unit = sections.find("geometry/unit");
  std::string data_file = required(sections, "file1/name", name);
  // Programs for Windows write whole paths.
  if (const std::size_t slash = data_file.rfind('\\'); slash != data_file.npos) data_file.erase(0, slash + 1);
  const std::string data_path = path_of_data_file(path, data_file);
  open_data_file(data_path, data_file, name, "VGStudio");
  return placed(volume_info(dims, type,
                            nrrd_fields_of(spaced(spacing, unit == sections.end() ? "mm" : unit->second),
                                           pairs_of(sections, "vgi_"))),
                path, data_path, offset);
}

bool begins_xtekct(std::string_view bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  return bytes.starts_with("[XTekCT]");
}

std::unique_ptr<VolumeSource> open_xtekct(std::unique_ptr<FileBytes> file, const std::string& path,
                                          const SourceDescription& source) {
  const std::string name = file->name();
  if (source.raw) throw UsageError(name + ": is a Nikon file", Problem::describes_itself);
  if (path == "-")
    throw UsageError(name + ": is a Nikon file, whose samples are in another file; give it by its name");
  const Sections sections = read_sections(*file);
  const auto count = [&](const char* field) {
    return integer_of(name, field, required(sections, "xtekct/" + lower_case(field), name));
  };
  const Index3 dims{count("VoxelsX"), count("VoxelsY"), count("VoxelsZ")};
  require_size(name, dims, SampleType::uint8);
  const fs::path data_path = fs::path(path).replace_extension(".vol");
  const auto data = open_data_file(data_path.string(), data_path.filename().string(), name, "Nikon");
  // The description does not say the type.
  std::optional<SampleType> type;
  for (const SampleType one : {SampleType::uint8, SampleType::uint16, SampleType::float32})
    if (sample_bytes(dims, one) == data->size()) type = one;
  if (!type)
    throw BrokenInput(
        fmt::format("{}: has {} bytes, but {} x {} x {} samples of 1, 2 or 4 bytes are expected ({})",
                    data->name(), data->size().value_or(0), dims.x, dims.y, dims.z, name));
  const auto size = [&](const char* field) {
    const auto found = sections.find(fmt::format("xtekct/voxelsize{}", field));
    return found == sections.end() ? std::string_view() : std::string_view(found->second);
  };
  const auto spacing = sizes_of({size("x"), size("y"), size("z")});
  return placed(
      volume_info(dims, *type, nrrd_fields_of(spaced(spacing, "mm"), pairs_of(sections, "xtekct_"))), path,
      data_path.string(), 0);
}

}  // namespace tagrid
