#include "pipeline/mesh/point_ids.h"

namespace tagrid {
namespace {

template <class Visit>
void for_each_point_of(const Box& box, Visit visit) {
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
      for (std::int64_t x = box.low.x; x <= box.high.x; ++x) visit(Index3{x, y, z});
}

}  // namespace

PointIds::PointIds(const BrickGrid& bricks) : bricks_(bricks), row_(bricks.domain.padded().size().x) {}

void PointIds::make_faces() {
  const Index3 brick = bricks_.closed_box({0, 0, 0}).size();
  const std::int64_t points[3] = {brick.y * brick.z, row_ * brick.z, row_ * bricks_.domain.padded().size().y};
  for (int axis = 0; axis < 3; ++axis)
    if (bricks_.bricks(axis) > 1) faces_[axis].assign(static_cast<std::size_t>(points[axis]), none);
}

// The place of `p` in the face left behind along `axis`.
std::int64_t& PointIds::shared(int axis, Index3 p) {
  const Index3 q = p - box_.low;
  const std::int64_t at = axis == 0   ? q.z * box_.size().y + q.y
                          : axis == 1 ? q.z * row_ + p.x
                                      : p.y * row_ + p.x;
  return faces_[axis][static_cast<std::size_t>(at)];
}

void PointIds::begin_brick(Index3 position) {
  if (position == Index3{0, 0, 0}) make_faces();
  position_ = position;
  box_ = bricks_.closed_box(position);
  ids_.assign(static_cast<std::size_t>(box_.count()), none);
  for (int axis = 2; axis >= 0; --axis) {
    if (position[axis] == 0) continue;
    Box face = box_;
    face.high[axis] = box_.low[axis];
    for_each_point_of(face, [&](Index3 p) { of(p) = shared(axis, p); });
  }
}

void PointIds::end_brick() {
  for (int axis = 0; axis < 3; ++axis) {
    if (position_[axis] + 1 == bricks_.bricks(axis)) continue;
    Box face = box_;
    face.low[axis] = box_.high[axis];
    for_each_point_of(face, [&](Index3 p) { shared(axis, p) = of(p); });
  }
}

}  // namespace tagrid
