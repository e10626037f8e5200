// The numbers that bricks of a mesh or a surface leave on their faces for later bricks.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/grid/domain.h"

namespace tagrid {

/// The ids of points on the faces between bricks, for one brick at a time. Points are those of the lattice, or with a
/// `scale` of 2 those with half the distances.
///
/// Later bricks share a staircase of high faces with the bricks so far: the x face of the last brick, the y faces of the
/// last row of bricks, and the z faces of the last layer. So one plane for each axis is enough, and memory follows one
/// layer of bricks, however many there are, provided that each brick leaves on its high faces all ids that it knows,
/// with those that earlier bricks left where its high faces meet its low ones. Then, among the earlier bricks that
/// contain a point, the last one knows its id if any does. This is the brick on the other side of the x face if the
/// point lies on that face; otherwise of the y face; otherwise of the z face.
class IdPlanes {
 public:
  static constexpr std::int64_t none = -1;

  /// Only for the bricks at `positions`.
  IdPlanes(const BrickGrid& bricks, const Box& positions, int scale);

  /// The heap that it takes from the first brick on.
  static std::uint64_t working_bytes(const BrickGrid& bricks, const Box& positions, int scale);

  /// REQUIRES: bricks come in the order of their numbers.
  void begin_brick(Index3 position);
  /// The points of the brick.
  const Box& box() const { return box_; }
  /// True if there was a brick on the other side of the low face across `axis`.
  bool has_low_face(int axis) const { return position_[axis] != positions_.low[axis]; }
  /// True if there will be one on the other side of the high face.
  bool has_high_face(int axis) const { return position_[axis] != positions_.high[axis]; }
  Box low_face(int axis) const;
  Box high_face(int axis) const;
  /// The id of a point of either face. On the low one it is what earlier bricks left until it is overwritten on the
  /// high one. REQUIRES: the brick has that face.
  std::int64_t& at(int axis, Index3 p) { return planes_[axis][place(axis, p)]; }
  std::int64_t at(int axis, Index3 p) const { return planes_[axis][place(axis, p)]; }
  /// Sets all ids on the high faces to `none`.
  void clear_high_faces();

 private:
  Box scaled(const Box& box) const;
  Index3 points_of_planes() const;
  std::size_t place(int axis, Index3 p) const;

  BrickGrid bricks_;
  Box positions_;  ///< of the bricks that will come
  int scale_;
  Box all_;                              ///< the points of all of them
  Index3 position_;                      ///< of the current brick
  Box box_;                              ///< its points
  std::vector<std::int64_t> planes_[3];  ///< by axis
};

/// Calls visit(Index3) for the points of a box, x fastest.
template <class Visit>
void for_each_point_of(const Box& box, Visit visit) {
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
      for (std::int64_t x = box.low.x; x <= box.high.x; ++x) visit(Index3{x, y, z});
}

}  // namespace tagrid
