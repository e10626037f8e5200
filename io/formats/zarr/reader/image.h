// Which array of a store is meant, and what OME-Zarr says of it: https://ngff.openmicroscopy.org, versions
// 0.1 to 0.5.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/formats/zarr/reader/array.h"
#include "io/formats/zarr/reader/store.h"

namespace tagrid {

struct ZarrAxis {
  std::string name, unit;
  /// The position of sample i: scale * i + translation.
  double scale = 1, translation = 0;
};

struct ZarrImage {
  ZarrArray array;
  std::string metadata_key;    ///< of the array
  std::vector<ZarrAxis> axes;  ///< of the array
  bool has_scale = false, has_translation = false;
  bool is_finest = false;  ///< the first one of its levels
  std::string name;
  Json attributes = Json::object();  ///< of the group of levels, if it has one, otherwise of the array
  std::string group;  ///< the path of the group of levels, otherwise of the group that has the array
  std::vector<std::string> remarks;  ///< sentences for users
  std::vector<std::string> doubts;   ///< the same, of what is not understood

  /// The axes of the array that are x, y and z; nothing for a z that is missing.
  std::array<std::optional<std::size_t>, 3> space() const;
};

/// The array that `wanted` names (or the finest one of the levels in the group that it names), or numbers, of
/// all that could be meant; without `wanted`, the only one. Throws SeveralVolumes, UsageError, BrokenInput.
ZarrImage chosen_image(const ZarrStore& store, const std::string& wanted);

// Which of several volumes in one array is meant.

/// The number along each axis of the volume that `wanted` names; along x, y and z, 0. `path` is for messages. Throws
/// SeveralVolumes, UsageError, BrokenInput.
std::vector<std::int64_t> chosen_volume(const std::string& path, const ZarrImage& image,
                                        const std::string& wanted);

}  // namespace tagrid
