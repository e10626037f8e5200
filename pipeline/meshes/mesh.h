// The tetrahedral grid of a .tag file as a mesh.
#pragma once

#include <cstdint>
#include <optional>

#include "pipeline/decode/decode_run.h"
#include "pipeline/meshes/grid_input.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

struct MeshOptions {
  /// The prefix of the grid up to this level, without points of higher levels; by default the entire grid.
  std::optional<int> level;
  /// Fills complete root cubes, instead of ending at the last samples.
  bool padded = false;
  bool overwrite = false;
  /// Instead of the file's grid, the coarsest within this error of all decoded voxels, in units of values.
  std::optional<double> coarsen = {};
  /// Only tetrahedra that meet this region. Its step must be 1.
  WantedRegion region = {};
  bool of_samples = false;  ///< `coarsen` is an error of stored samples
};

using MeshRun = GridRun<MeshOptions>;

struct MeshResult : GridResult {
  std::int64_t points = 0;
  std::int64_t tetrahedra = 0;
};

/// Writes the leaf tetrahedra of a .tag file, in the order of bricks (VtuFile has the arrays); with a region,
/// those that intersect it, for which only the bricks that it needs are read from a regular file.
///
/// Tetrahedra that reach beyond the box of the samples are cut there (cut_at()); pieces keep level and type.
/// Every point exists once, if a tetrahedron uses it, at its place in the world (to_world()). Tetrahedra are
/// positive there, also in a mirrored volume.
///
/// A point has the value of its decoded sample, or the stored value in a file without voxels; a point created
/// by a cut, that of the piecewise linear field, rounded to the type. A padded mesh is not cut: outside the
/// volume, points have the value of the nearest sample, or the stored value. Memory: that of decoding, the
/// activity and the ids of a layer of bricks, and that of a program that writes the file.
///
/// A coarsened mesh has the (nearest) decoded sample at each point, also in files without voxels. For a
/// region, the entire volume is read and coarsened.
///
/// Throws UsageError for an impossible level, a level together with an error, an error that is not a number
/// of at least 0, a region outside the volume, a name without a format, and a volume of one slice that is not
/// padded; MemoryLimit, BrokenInput, WorldError. Then nothing is left under the name of the output.
Finished<MeshResult> write_mesh(const MeshRun& run);

}  // namespace tagrid
