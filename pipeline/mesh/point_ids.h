// Numbers of the points of a mesh that is made brick by brick, the same in every brick that shares a point.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/grid/domain.h"

namespace tagrid {

/// The ids that lattice points were given, for one brick at a time. A point on a face, edge or corner between
/// bricks keeps the id that the first of them gave it.
///
/// What later bricks share with the bricks so far is a staircase of high faces: the x face of the last brick,
/// the y faces of the last row of bricks, the z faces of the last layer. Each brick begins with everything
/// that is known on its low faces and leaves its high faces behind, known ids included. So of all bricks
/// before it that hold a point, the last one knows all that the others knew, and that is the one on the other
/// side of the x face if the point lies on it, else of the y face, else of the z face: faces are taken over
/// in the order z, y, x, and one plane for each axis is enough.
///
/// Memory: 8 bytes for every point of one brick and of one slice of all bricks, from the first brick on: not
/// before there is one.
class PointIds {
 public:
  static constexpr std::int64_t none = -1;

  /// Of the bricks at `positions` alone.
  PointIds(const BrickGrid& bricks, const Box& positions);
  explicit PointIds(const BrickGrid& bricks)
      : PointIds(bricks, Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)})) {}

  /// Takes up the ids that are known on the low faces. REQUIRES: bricks come in the order of their numbers,
  /// each ended before the next.
  void begin_brick(Index3 position);
  /// The id of a point of the brick; to be set where it is `none`. REQUIRES: the brick's closed box contains
  /// `p`.
  std::int64_t& of(Index3 p) { return ids_[static_cast<std::size_t>(box_.offset(p))]; }
  /// Leaves the ids on the high faces to the bricks after it.
  void end_brick();

 private:
  void make_faces();
  std::int64_t& shared(int axis, Index3 p);

  BrickGrid bricks_;
  Box positions_;                       ///< of the bricks that come
  Box all_;                             ///< their closed boxes together
  Index3 position_;                     ///< of the brick
  Box box_;                             ///< its closed box
  std::vector<std::int64_t> ids_;       ///< of all points of box_, x fastest
  std::vector<std::int64_t> faces_[3];  ///< left behind by the bricks before, by axis
};

}  // namespace tagrid
