// A mesh with materials of the samples of a .tag file.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/meshes/material_mesh.h"
#include "io/tag/bricks.h"
#include "pipeline/decode/decode_run.h"
#include "pipeline/materials/mesh_assembler.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

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
  int order = 1;  ///< 2: tetrahedra of ten nodes
  /// Only tetrahedra that meet this region. Its step must be 1.
  WantedRegion region = {};
};

struct MaterialMeshResult {
  MaterialMesh mesh;
  MeshQuality quality;
  double fine = 0, coarse = 0;  ///< edges of cubes, in MaterialMesh::unit
  std::vector<std::string> warnings = {};
};

/// The mesh of the samples of a .tag file, in nameless temporary files beside `path`.
///
/// The lattice is cubic in the world, whatever the spacing of samples is, and begins at the first sample; it ends at
/// the last complete cube. Every tetrahedron has one material; interfaces are where interpolated values reach a
/// threshold, or where another label begins to prevail. The mesh is the same for any number of threads.
///
/// Memory: the slices around a layer of bricks of the mesh, a brick for each thread, and what bricks share.
/// Throws UsageError for impossible options, MemoryLimit, BrokenInput, WorldError.
MaterialMeshResult make_material_mesh(const TagBricks& file, const MaterialMeshOptions& options,
                                      const std::string& path, const Resources& resources,
                                      const Progress& progress = {});

}  // namespace tagrid
