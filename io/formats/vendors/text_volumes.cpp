// Volumes of VGStudio and Nikon. Nikon's program writes both descriptions of one .vol file: the volume has both.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "io/errors/errors.h"
#include "io/files/slice_files.h"
#include "io/formats/vendors/descriptions.h"
#include "io/formats/vendors/vendors.h"
#include "io/metadata/lengths.h"
#include "io/metadata/metadata.h"
#include "io/samples/data_files.h"
#include "io/samples/file_samples.h"
#include "io/samples/slices_in_files.h"
#include "io/system/files.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// One of the two kinds of descriptions.
struct Kind {
  std::string_view name, extension;
  bool (*begins)(std::string_view bytes);
  TextDescription (*describe)(FileBytes& file, const std::string& path);
};

constexpr Kind vgi = {"VGStudio", ".vgi", begins_vgi, describe_vgi};
constexpr Kind xtekct = {"Nikon", ".xtekct", begins_xtekct, describe_xtekct};

/// The other description of the samples; `described` is empty if it cannot be read, and `why_not` says why.
struct OtherDescription {
  std::string path;
  std::optional<TextDescription> described;
  std::string why_not;
};

std::optional<OtherDescription> read_other(const Kind& kind, const std::string& path,
                                           const std::string& data_path) {
  const auto status = status_of(path);
  if (!status || !status->is_file()) return std::nullopt;
  try {
    FileBytes file(path);
    if (!kind.begins(file.peek(64))) return std::nullopt;
    OtherDescription other{path, kind.describe(file, path), ""};
    if (!is_same_file(other.described->data_path, data_path)) return std::nullopt;
    return other;
  } catch (const Error& error) {
    return OtherDescription{path, std::nullopt, error.what()};
  }
}

/// The description of the same samples in the other format, in their directory. One that cannot be
/// read is assumed to describe them if it has their name.
std::optional<OtherDescription> other_description(const Kind& kind, const std::string& data_path) {
  const fs::path data = data_path, folder = data.parent_path();
  if (const auto status = status_of(folder.empty() ? "." : folder.string()); !status || !status->is_folder())
    return std::nullopt;
  std::vector<std::string> candidates;
  for (const std::string& path : visible_files(folder.empty() ? "." : folder.string()))
    if (lower_case(fs::path(path).extension().string()) == kind.extension)
      candidates.push_back((folder / fs::path(path).filename()).string());
  std::stable_partition(candidates.begin(), candidates.end(),
                        [&](const std::string& path) { return fs::path(path).stem() == data.stem(); });
  for (const std::string& path : candidates)
    if (auto other = read_other(kind, path, data_path);
        other && (other->described || fs::path(path).stem() == data.stem()))
      return other;
  return std::nullopt;
}

/// The distance between samples along an axis in mm; nothing if it is not known.
std::optional<double> distance_of(const Geometry& geometry, std::size_t axis) {
  const auto unit = length_unit(geometry.units[axis]);
  if (!geometry.has_spacing || !unit || !std::isfinite(geometry.spacing[axis])) return std::nullopt;
  return converted(geometry.spacing[axis], *unit, *length_unit("mm"));
}

/// Says where two descriptions of one file contradict each other.
void compare(const TextDescription& own, const TextDescription& other, SourceFacts& facts) {
  const auto say = [&](const std::string& one, const std::string& two) {
    facts.not_understood.push_back(
        fmt::format("{} states {}, but {} states {}; the former is used", own.path, one, other.path, two));
  };
  const auto size = [](const Index3& dims) {
    return fmt::format("{} x {} x {} samples", dims.x, dims.y, dims.z);
  };
  if (own.dims != other.dims) say(size(own.dims), size(other.dims));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto one = distance_of(own.geometry, axis), two = distance_of(other.geometry, axis);
    // Both are rounded texts.
    if (!one || !two || std::abs(*one - *two) <= 1e-4 * *one) continue;
    const auto distance = [&](double mm) {
      return fmt::format("a distance of {:.6g} mm along {}", mm, "xyz"[axis]);
    };
    say(distance(*one), distance(*two));
    return;
  }
}

/// The type of samples by the size of their file: Nikon's description does not say it.
SampleType type_by_size(const TextDescription& own, const FileBytes& data) {
  for (const SampleType one : {SampleType::uint8, SampleType::uint16, SampleType::float32})
    if (sample_bytes(own.dims, one) == data.size()) return one;
  throw BrokenInput(
      fmt::format("{}: has {} bytes, but {} x {} x {} samples of 1, 2 or 4 bytes are expected ({})",
                  data.name(), data.size().value_or(0), own.dims.x, own.dims.y, own.dims.z, own.path));
}

std::unique_ptr<VolumeSource> open_described(const Kind& kind, const Kind& other_kind,
                                             std::unique_ptr<FileBytes> file, const std::string& path,
                                             const SourceDescription& source) {
  TextDescription own = kind.describe(*file, path);
  SourceFacts facts;
  facts.files = {path};
  facts.warnings = std::move(own.warnings);
  const auto other = other_description(other_kind, own.data_path);
  if (other) facts.files.push_back(other->path);
  facts.files.push_back(own.data_path);
  require_inside(path, {facts.files.begin() + 1, facts.files.end()}, source.data_outside, facts.warnings);
  const auto data = open_data_file(own.data_path, own.data_file, file->name(), kind.name);
  facts.not_understood = std::move(own.not_understood);
  std::optional<SampleType> type = own.type;
  if (other && other->described) {
    compare(own, *other->described, facts);
    own.pairs.insert(own.pairs.end(), other->described->pairs.begin(), other->described->pairs.end());
    if (const auto given = other->described->type;
        !type && given && sample_bytes(own.dims, *given) == data->size())
      type = given;
  } else if (other) {
    facts.warnings.push_back(
        fmt::format("{}: the other description of its samples cannot be read: {}", path, other->why_not));
  }
  if (!type) type = type_by_size(own, *data);
  facts.info = {own.dims, *type, Metadata(own.geometry, own.pairs)};
  facts.holds_other_bytes = true;  // the description says more than the file that is made
  SamplesPlace place{.start = own.offset};
  allow_more(*data, place, facts);
  const std::uint64_t slice = *sample_bytes({own.dims.x, own.dims.y, 1}, *type);
  const std::size_t number = facts.files.size() - 1;
  return placed_samples(std::move(facts), {{number, own.offset, own.dims.z, slice, false}});
}

}  // namespace

bool begins_vgi(std::string_view bytes) {
  const std::size_t begin = bytes.find_first_not_of(" \t\r\n");
  return begin != bytes.npos && bytes.substr(begin).starts_with("{volume");
}

bool begins_xtekct(std::string_view bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  return bytes.starts_with("[XTekCT]");
}

std::unique_ptr<VolumeSource> open_vgi(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source) {
  return open_described(vgi, xtekct, std::move(file), path, source);
}

std::unique_ptr<VolumeSource> open_xtekct(std::unique_ptr<FileBytes> file, const std::string& path,
                                          const SourceDescription& source) {
  return open_described(xtekct, vgi, std::move(file), path, source);
}

}  // namespace tagrid
