// Builds tetrahedra from bricks, with the numbers and values of their points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "io/meshes/mesh_sink.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "io/tag/header.h"
#include "io/volume/volume_info.h"
#include "pipeline/memory/plan.h"
#include "pipeline/memory/resources.h"
#include "pipeline/meshes/grid_bricks.h"
#include "pipeline/meshes/id_planes.h"
#include "pipeline/progress/progress.h"
#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// The part of the mesh that is built.
struct MeshPart {
  /// The prefix of the grid up to this level: points of higher levels are left out.
  int level = 0;
  /// Fills complete root cubes, instead of ending at the last samples.
  bool padded = false;
  /// Only tetrahedra that meet this box; both ends are included.
  std::optional<Box> box = std::nullopt;
};

/// Builds the tetrahedra of bricks, in the order of bricks.
class MeshBuilder : public GridTaker {
 public:
  /// `header` and `sink` must outlive the builder. `positions`: of the bricks that will come, with all that
  /// meet the box of the part.
  MeshBuilder(const TagHeader& header, const Box& positions, const MeshPart& part, MeshSink& sink);

  /// The peak of the heap that a builder takes for the bricks at `positions`: the ids of points, what waits
  /// for the sink, and the grid and the field of one brick at the border of the volume.
  static std::uint64_t working_bytes(const CodingParameters& parameters, const Box& positions);

  /// REQUIRES: bricks come in the order of their numbers.
  void add_brick(Index3 position, const LatticeBits& active, const ValueOf& value_of) override;

 private:
  static constexpr std::size_t batch = std::size_t{1} << 16;  // tetrahedra that wait for the sink

  // The points that wait: four for each tetrahedron, and each point of a brick once.
  static std::size_t most_points(const CodingParameters& parameters, const Box& positions);

  void add_leaves(const LatticeBits& active, const ValueOf& value_of);
  void add_cut_leaves(const LatticeBits& active, const ValueOf& value_of);
  void add_tetrahedron(const std::array<Index3, 4>& vertices, int level, const ValueOf& value_of);
  std::int64_t id_of(Index3 p, const ValueOf& value_of);
  void flush();

  const CodingParameters& parameters_;
  Geometry geometry_;
  bool mirrored_;
  MeshPart part_;
  PointIds ids_;
  std::int64_t next_id_ = 0;
  MeshSink& sink_;
  std::vector<double> coordinates_;
  std::vector<std::byte> values_;
  std::vector<std::int64_t> connectivity_;
  std::vector<std::uint8_t> levels_;
};

/// The plan of mesh_all(). Throws MemoryLimit.
DecodePlan plan_mesh(const CodingParameters& parameters, const Resources& resources);

/// The entire mesh, from a file that has not been read yet, front to back. Memory: that of decoding, and the
/// activity of one layer of bricks. Throws BrokenInput, WorldError, and the exceptions of `sink` and
/// `progress`. REQUIRES: no box; the grid has the level; padded, or !is_flat().
void mesh_all(TagReader& reader, const MeshPart& part, const Resources& resources, MeshSink& sink,
              const Progress& progress = {});

/// The memory of mesh_box() with a number of threads.
std::uint64_t memory_of_mesh_box(const CodingParameters& parameters, const MeshPart& part, int threads);

/// The part of the mesh that meets a box. Reads the bricks that contain some of it, and the bricks below
/// them, which own the samples on their low faces. Memory: these bricks of two layers. Progress counts layers
/// of bricks. Throws as mesh_all() does, and MemoryLimit. REQUIRES: a box within the volume; the grid has the
/// level; padded, or !is_flat().
void mesh_box(const TagBricks& file, const MeshPart& part, const Resources& resources, MeshSink& sink,
              const Progress& progress = {});

}  // namespace tagrid
