// Builds tetrahedra from bricks, with the numbers and values of their points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "io/meshes/sinks.h"
#include "io/tag/header.h"
#include "io/volume/volume_info.h"
#include "pipeline/meshes/grid_bricks.h"
#include "pipeline/meshes/id_planes.h"
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
  /// `header` and `sink` must outlive the builder. `positions`: of all bricks that will come.
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

}  // namespace tagrid
