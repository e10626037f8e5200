// Where the voxels of a grid are: in the world, and among the voxels of the volume. What a .tag file says of
// it.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "io/formats/vdb/openvdb_library.h"
#include "io/metadata/metadata.h"
#include "stages/grid/box.h"

namespace tagrid {

/// tagrid's own metadata of a grid: the type and the number of samples, the lines of the NRRD header, the
/// largest error.
inline constexpr const char *vdb_type_key = "tagrid_type", *vdb_dims_key = "tagrid_dims",
                            *vdb_fields_key = "tagrid_nrrd_fields", *vdb_error_key = "tagrid_max_error";

/// Properties of a grid that a .tag file keeps as key-value pairs, so that decoding restores them.
struct VdbPlace {
  Index3 low;                        ///< the voxel that is the first sample
  std::string grid;                  ///< its name; "" if there is none
  std::string grid_class;            ///< what its values are, in the library's words: "level set"; or ""
  std::optional<double> background;  ///< value of the inactive voxels
};

KeyValues pairs_of(const VdbPlace& place);
/// The pairs that stay true if the grid gets another place.
KeyValues other_pairs_of(const Metadata& metadata);
/// Reads these pairs. Missing or invalid values are those of VdbPlace{}.
VdbPlace vdb_place_of(const Metadata& metadata);

/// The position of voxels in the world: rows for x, y, z, and the one of voxel (0, 0, 0). Nothing if the
/// transform is a perspective one, which has no directions.
std::optional<openvdb::Mat4d> matrix_of(const openvdb::math::Transform& transform);
/// The matrix of a volume whose first sample is voxel `low`. Unknown parts of its geometry count as 1.
openvdb::Mat4d matrix_of(const Geometry& geometry, const Index3& low);

/// The same as a transform, with the simplest of the library's maps, because programs can do more with a
/// uniform one. The library rounds its numbers, by some units in the last place. Throws openvdb::Exception if
/// it cannot have them.
openvdb::math::Transform::Ptr transform_of(const Geometry& geometry, const Index3& low);

/// Directions and origin of a volume whose first sample is voxel `low`.
Geometry geometry_of(const openvdb::Mat4d& matrix, const Index3& low);

}  // namespace tagrid
