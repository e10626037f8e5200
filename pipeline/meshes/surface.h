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
  /// Closes the surface at the border of the volume, as if values outside were below `iso`; likewise around
  /// NaN.
  bool close = false;
  /// Measures the area, which takes some time.
  bool area = false;
  bool overwrite = false;
};

using SurfaceRun = GridRun<SurfaceOptions>;

struct SurfaceResult : GridResult {
  SurfaceCounts counts;
  /// Edges with one triangle alone; nothing if the surface has borders that are not counted, at a region or
  /// around NaN.
  std::optional<std::int64_t> boundary_edges;
};

/// Writes the isosurface of the piecewise linear field of the mesh that write_mesh() writes: it passes
/// between the points with at least the value `iso`, which are inside, and all others. Triangles are
/// counterclockwise if seen from outside, so that normals point towards lower values, in a mirrored volume,
/// too.
///
/// Within the volume, every edge has exactly two triangles, one in each direction, whatever the bricks are. A
/// vertex lies on an edge of the mesh (see SurfaceVertex), and exists once. Memory: that of decoding, and of
/// the surface in one brick.
///
/// Throws UsageError for a level that the grid cannot have, for a region that is not in the volume, for a
/// name that does not say a format, for a volume of one slice, and for a value if the scale of values is in
/// doubt or each slice has a slope of its own; MemoryLimit, BrokenInput, WorldError; then nothing is left
/// under the name of the output.
Finished<SurfaceResult> write_surface(const SurfaceRun& run);

}  // namespace tagrid
