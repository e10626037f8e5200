// The position of the voxels of an OpenVDB grid in the world, and the NRRD fields that express it.
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
/// BrokenInput for values that are not numbers, and for a degenerate transform.
std::optional<VdbTransform> read_vdb_transform(VdbBytes& bytes);

/// Writes it as the simplest of OpenVDB's maps, because programs can do more with a uniform one.
void put_vdb_transform(FieldWriter& out, const VdbTransform& transform);

/// The transform of a volume whose first sample is voxel `low`. Unknown parts of its geometry count as 1.
VdbTransform vdb_transform_of(const Geometry& geometry, const Index3& low);

/// Other properties of a grid, which a .tag file keeps as NRRD key-value pairs so that decoding restores
/// them.
struct VdbPlace {
  Index3 low;                        ///< The voxel that is the first sample.
  std::string grid;                  ///< "" if there is none, or if a header cannot hold it.
  std::optional<double> background;  ///< Value of the inactive voxels.
};

/// The NRRD header lines for the transform and the place.
std::string nrrd_fields_of(const std::optional<VdbTransform>& transform, const VdbPlace& place);
/// Reads those lines; other lines are ignored. Missing or invalid values are those of VdbPlace{}.
VdbPlace vdb_place_of(std::string_view nrrd_fields);

}  // namespace tagrid
