// Where the voxels of an OpenVDB grid lie in the world, and what NRRD says of the same.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "io/bytes/byte_fields.h"
#include "io/vdb/bytes.h"
#include "io/volume/volume_info.h"
#include "stages/grid/box.h"

namespace tagrid {

/// Voxel (x, y, z) is at origin + x * directions[0] + y * directions[1] + z * directions[2].
struct VdbTransform {
  std::array<std::array<double, 3>, 3> directions = {};
  std::array<double, 3> origin = {};

  friend bool operator==(const VdbTransform&, const VdbTransform&) = default;
};

/// Reads the transform of a grid; nothing if it is a perspective one, which has no directions. Throws
/// BrokenInput for numbers that are none, and for a flat world.
std::optional<VdbTransform> read_vdb_transform(VdbBytes& bytes);

/// Writes it as the simplest of OpenVDB's maps: programs can do more with a uniform one.
void put_vdb_transform(FieldWriter& out, const VdbTransform& transform);

/// That of a volume whose first sample is voxel `low`. What is not known of its geometry counts as 1.
VdbTransform vdb_transform_of(const Geometry& geometry, const Index3& low);

/// What else a .tag file keeps of a grid, as NRRD key-value pairs, so that decoding gives it back.
struct VdbPlace {
  Index3 low;                        ///< The voxel that is the first sample.
  std::string grid;                  ///< "": none that a header could hold.
  std::optional<double> background;  ///< Of the inactive voxels.
};

/// The lines of an NRRD header for both.
std::string nrrd_fields_of(const std::optional<VdbTransform>& transform, const VdbPlace& place);
/// Reads those lines among others. What is missing or makes no sense is as it is in VdbPlace{}.
VdbPlace vdb_place_of(std::string_view nrrd_fields);

}  // namespace tagrid
