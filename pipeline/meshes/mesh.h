// The tetrahedral grid of a .tag file as a mesh.
#pragma once

#include <cstdint>
#include <optional>

#include "pipeline/decode/decode_run.h"
#include "pipeline/meshes/grid_input.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

struct MeshOptions {
  /// The prefix of the grid up to this level: points of higher levels are left out. The entire grid if not
  /// given.
  std::optional<int> level;
  /// Fills complete root cubes, instead of ending at the last samples.
  bool padded = false;
  bool overwrite = false;
  /// Instead of the grid of the file, the coarsest one whose mesh is within this error of all decoded voxels,
  /// in units of values.
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

/// Writes the leaf tetrahedra of a .tag file, brick by brick in their order; see VtuFile for the arrays. With
/// a region, these are the tetrahedra of the entire mesh that intersect it; from a regular file, only the
/// bricks that it needs are read.
///
/// The mesh fills the box of the samples: tetrahedra that reach beyond it are cut there (see cut_at()), and
/// their pieces keep level and type. Every point exists once, and only if a tetrahedron uses it. Its position
/// is that given by the volume's header (to_world()). Tetrahedra are positive there, also in a mirrored
/// volume.
///
/// A point's value is that of its decoded sample; in a file without voxels, it is the stored value. A point
/// created by a cut has the value of the piecewise linear field, rounded to the type. A padded mesh is not
/// cut: a point outside the volume has the value of the nearest decoded sample, or the stored value. Memory:
/// that of decoding, the activity and the ids of one layer of bricks, and that of a program that writes the
/// file.
///
/// A coarsened mesh has the decoded sample as the value of each point, or the nearest one, in files without
/// voxels, too. Of a region, it is the part of the coarsened mesh of the entire volume, all of which is read.
///
/// Throws UsageError for a level that the grid cannot have, for a level together with an error, for an error
/// that is not a number of at least 0, for a region that is not in the volume, for a name that does not say a
/// format, and for a volume of one slice that is not padded, as it fills no space; MemoryLimit, BrokenInput,
/// WorldError; then nothing is left under the name of the output.
Finished<MeshResult> write_mesh(const MeshRun& run);

}  // namespace tagrid
