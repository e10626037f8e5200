// Numbers the vertices of a surface that is made brick by brick; bricks that share an edge of the grid give the vertex
// on it the same number.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "stages/grid/domain.h"

namespace tagrid {

/// The ids of vertices on the faces between bricks. An edge of the grid is named by the sum of its ends (see
/// EdgeNumbers), a point of the lattice with half the distances.
///
/// As with PointIds, the bricks so far share a staircase of high faces with later ones: the x face of the last brick,
/// the y faces of the last row, and the z faces of the last layer. Each brick leaves on its high faces all ids that it
/// knows: those of its vertices, and those that earlier bricks left where its high faces meet its low ones. So the last
/// earlier brick that contains an edge knows its id if any brick does; this is the one on the other side of the x face
/// if the edge lies in it, otherwise of the y face, otherwise of the z face. One plane for each axis is enough.
class EdgeIds {
 public:
  static constexpr std::int64_t none = -1;

  /// For the bricks at `positions`.
  EdgeIds(const BrickGrid& bricks, const Box& positions);

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
  void make_planes();
  std::size_t place(int axis, Index3 sum) const;

  BrickGrid bricks_;
  Box positions_;                                           // of the bricks that will come
  Box all_;                                                 // twice their closed boxes together
  Index3 position_;                                         // of the current brick
  Box box_;                                                 // twice its closed box
  std::vector<std::int64_t> planes_[3];                     // ids of the bricks before, by axis
  std::vector<std::pair<Index3, std::int64_t>> inherited_;  // on lines between a low and a high face
};

}  // namespace tagrid
