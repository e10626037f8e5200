// Numbers the points of a mesh that is made brick by brick; bricks that share a point give it the same
// number.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/grid/domain.h"

namespace tagrid {

/// The ids of lattice points, for one brick at a time. A point on a face, edge or corner between bricks keeps
/// the id that it got in the first of them.
///
/// Later bricks share a staircase of high faces with the bricks so far: the x face of the last brick, the y
/// faces of the last row of bricks, and the z faces of the last layer. Each brick takes over the ids that are
/// known on its low faces, and leaves all ids on its high faces. So among the earlier bricks that contain a
/// point, the last one knows every id that the others knew. This is the brick on the other side of the x face
/// if the point lies on that face; otherwise of the y face; otherwise of the z face. Therefore faces are
/// taken over in the order z, y, x, and one plane for each axis is enough.
class PointIds {
 public:
  static constexpr std::int64_t none = -1;

  /// Only for the bricks at `positions`.
  PointIds(const BrickGrid& bricks, const Box& positions);
  explicit PointIds(const BrickGrid& bricks)
      : PointIds(bricks, Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)})) {}

  /// The heap that it takes from the first brick on: the ids of one brick, and of one plane for each axis.
  static std::uint64_t working_bytes(const BrickGrid& bricks, const Box& positions);

  /// Takes over the ids that are known on the low faces. REQUIRES: bricks come in the order of their numbers,
  /// and each ends before the next begins.
  void begin_brick(Index3 position);
  /// The id of a point of the brick; if it is `none`, the caller sets it. REQUIRES: the brick's closed box
  /// contains `p`.
  std::int64_t& of(Index3 p) { return ids_[static_cast<std::size_t>(box_.offset(p))]; }
  /// Leaves the ids on the high faces for later bricks.
  void end_brick();

 private:
  void make_faces();
  std::int64_t& shared(int axis, Index3 p);

  BrickGrid bricks_;
  Box positions_;                       ///< of the bricks that will come
  Box all_;                             ///< their closed boxes together
  Index3 position_;                     ///< of the current brick
  Box box_;                             ///< its closed box
  std::vector<std::int64_t> ids_;       ///< of all points of box_, x fastest
  std::vector<std::int64_t> faces_[3];  ///< of the bricks before, by axis
};

}  // namespace tagrid
