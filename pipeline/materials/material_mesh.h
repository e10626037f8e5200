// A mesh with materials of the samples of a .tag file.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/meshes/material_mesh.h"
#include "io/metadata/geometry.h"
#include "io/tag/bricks.h"
#include "pipeline/decode/decode_run.h"
#include "pipeline/materials/mesh_assembler.h"
#include "pipeline/memory/resources.h"
#include "pipeline/meshes/grid_input.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

class BrickSpool;
struct MaterialMeshJob;

/// The values of a material: from `low` up to, but not including, `high`.
struct MaterialRange {
  std::string name;
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

/// Samples are labels of materials.
struct LabelsWish {
  /// The names of the labels to be meshed. If there are none, all labels but 0 are.
  std::map<std::int64_t, std::string> names;
  /// The distance between the knots of the B-splines that smooth interfaces, in samples; 0: none. See LabelField.
  double smoothing = 1;
};

/// A length, in a unit of lengths; "": in that of the file.
struct MeshLength {
  double length = 0;
  std::string unit;
};

struct MaterialMeshOptions {
  /// The materials by value; empty if `labels` is set.
  std::vector<MaterialRange> ranges;
  std::optional<LabelsWish> labels;
  /// The names of the materials to be meshed; empty: all that have a name.
  std::vector<std::string> keep;
  PartsWish parts;
  /// The edge H of the finest cubes, which are at all interfaces. By default twice the smallest distance of samples.
  std::optional<MeshLength> fine;
  /// The edge of the coarsest cubes; made smaller to be 2, 4, 8, ... times H. By default 8 H.
  std::optional<MeshLength> coarse;
  /// Angles of at least 15 degrees (12 at the sides of the box) instead of 9, for vertices up to a tenth of H from the
  /// interface.
  bool prefers_angles = false;
  int order = 1;  ///< 2: tetrahedra of ten nodes
  /// A .tag file of labels, as large as the volume; without it, the volume has them.
  std::string label_volume;
  /// Only tetrahedra that meet this region. Its step must be 1.
  WantedRegion region = {};
  bool overwrite = false;
  bool counts_edges = true;  ///< MeshQuality::OfMaterial::touching_edges, which takes a while
};

struct MadeMaterialMesh {
  MaterialMesh mesh;
  MeshQuality quality;
  double fine = 0, coarse = 0;  ///< edges of cubes, in MaterialMesh::unit
  std::vector<std::string> warnings = {};
};

/// The mesh of the samples of a .tag file, in nameless temporary files. `geometry` is that of the samples, and `job` is
/// what settle_material_mesh() makes of the options.
///
/// The lattice is cubic in the world, whatever the spacing of samples is, and begins at the first sample; it ends at
/// the last complete cube. Every tetrahedron has one material; interfaces are where interpolated values reach a
/// threshold, or where another label begins to prevail. The mesh is the same for any number of threads.
///
/// Memory: the slices around a layer of bricks of the mesh, a brick for each thread, and what bricks share; `besides` is
/// that of what writes the mesh.
/// Throws MemoryLimit, BrokenInput, WorldError.
MadeMaterialMesh make_material_mesh(const TagBricks& samples, const MaterialMeshJob& job,
                                    const Geometry& geometry, const MaterialMeshOptions& options,
                                    const SpoolPlace& place, const Resources& resources,
                                    std::uint64_t besides = 0, const Progress& progress = {});

/// The mesh of bricks that were put together, however they were made.
MadeMaterialMesh finished_mesh(const TagBricks& samples, const MaterialMeshJob& job, const Geometry& geometry,
                               const MaterialMeshOptions& options, const SpoolPlace& place,
                               MeshAssembler& assembler);

using MaterialMeshRun = GridRun<MaterialMeshOptions>;

struct MaterialMeshResult : GridResult {
  MeshQuality quality;
  double fine = 0, coarse = 0;  ///< edges of cubes, in `unit`
  std::string unit;
  std::int64_t points = 0, tetrahedra = 0;
  std::vector<MaterialSurface> surfaces;
};

/// The files of a run.
struct MaterialMeshInputs {
  /// Throws UsageError if the labels are not as many as the samples, BrokenInput, WorldError.
  MaterialMeshInputs(const std::string& input, std::int64_t volume, const std::string& label_volume);

  const TagBricks& samples() const { return labels ? *labels : file; }
  Geometry geometry() const;

  TagBricks file;
  std::optional<TagBricks> labels;
  std::vector<std::string> warnings;
};

/// Makes all bricks of a mesh, with other processes.
using MakeBricks = std::function<void(BrickSpool&)>;

/// Writes such a mesh of a regular .tag file, in a format of material_mesh_formats(); `share` makes the bricks, if it
/// is set. Throws as make_material_mesh() does, and UsageError if the options are impossible, the output is in the way or
/// the format cannot hold the mesh; then nothing is left under the name of the output.
Finished<MaterialMeshResult> write_material_mesh(const MaterialMeshRun& run, const MakeBricks& share = {});

}  // namespace tagrid
