// The isosurface of a .tag file.
#pragma once

#include <cstdint>
#include <optional>

#include "pipeline/decode/decode_run.h"
#include "pipeline/meshes/grid_input.h"
#include "pipeline/meshes/surface_builder.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

struct SurfaceOptions {
  /// In the units of the values: slope * sample + intercept, where the file has a slope.
  double iso = 0;
  bool of_samples = false;  ///< `iso` is a stored sample, and the largest samples are inside
  /// The prefix of the grid up to this level; the entire grid if not given.
  std::optional<int> level = std::nullopt;
  /// Only the surface in tetrahedra that meet this region. Its step must be 1.
  WantedRegion region = {};
  /// Closes the surface at the border of the volume and around NaN, as if values there were below `iso`.
  bool close = false;
  /// Measures the area, which takes some time.
  bool area = false;
  bool overwrite = false;
};

using SurfaceRun = GridRun<SurfaceOptions>;

struct SurfaceResult : GridResult {
  SurfaceCounts counts;
  /// Edges with one triangle alone; nothing if a region or NaN make borders that are not counted.
  std::optional<std::int64_t> boundary_edges;
};

/// Writes the isosurface of the field of the mesh that write_mesh() writes. Points with at least the value
/// `iso` are inside. Triangles are counterclockwise if seen from outside, also in a mirrored volume.
///
/// Within the volume, every edge has exactly two triangles, one in each direction. A vertex lies on an edge
/// of the mesh (see SurfaceVertex), and exists once. Memory: that of decoding, and of the surface in one
/// brick.
///
/// Throws UsageError for an impossible level, a region outside the volume, a name without a format, a volume
/// of one slice, and a value whose scale is in doubt or differs between slices; MemoryLimit, BrokenInput,
/// WorldError. Then nothing is left under the name of the output.
Finished<SurfaceResult> write_surface(const SurfaceRun& run);

}  // namespace tagrid
