// Numbers the vertices of a surface that is made brick by brick; bricks that share an edge of the grid give the vertex
// on it the same number.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "pipeline/meshes/id_planes.h"
#include "stages/grid/domain.h"

namespace tagrid {

/// The ids of vertices on the faces between bricks, of which there are few in each brick. An edge of the grid is named
/// by the sum of its ends (see EdgeNumbers), a point of the lattice with half the distances. Each brick leaves on its
/// high faces the ids of its vertices, and those that earlier bricks left where its high faces meet its low ones.
class EdgeIds {
 public:
  static constexpr std::int64_t none = IdPlanes::none;

  /// For the bricks at `positions`.
  EdgeIds(const BrickGrid& bricks, const Box& positions) : planes_(bricks, positions, 2) {}

  /// The heap that it takes from the first brick on: a plane for each axis, and lines.
  static std::uint64_t working_bytes(const BrickGrid& bricks, const Box& positions);

  /// REQUIRES: bricks come in the order of their numbers, and each ends before the next begins.
  void begin_brick(Index3 position);
  /// The id that an earlier brick gave to the vertex on an edge of this brick, or none.
  std::int64_t carried(Index3 sum_of_ends) const;
  /// True if a later brick may ask for the edge.
  bool is_shared(Index3 sum_of_ends) const;
  /// Leaves an id for later bricks. REQUIRES: is_shared(); no more carried() for this brick.
  void leave(Index3 sum_of_ends, std::int64_t id);
  /// Makes room on the high faces for leave(). To be called after the last carried() of the brick.
  void clear_high_faces();

 private:
  IdPlanes planes_;
  std::vector<std::pair<Index3, std::int64_t>> inherited_;  // on lines between a low and a high face
};

}  // namespace tagrid
