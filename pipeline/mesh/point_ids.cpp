#include "pipeline/mesh/point_ids.h"

namespace tagrid {
namespace {

template <class Visit>
void for_each_point_of(const Box& box, Visit visit) {
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
      for (std::int64_t x = box.low.x; x <= box.high.x; ++x) visit(Index3{x, y, z});
}

// The points of the planes that are left behind along each axis.
Index3 points_of_faces(Index3 brick, Index3 all) {
  return {brick.y * brick.z, all.x * brick.z, all.x * all.y};
}

}  // namespace

PointIds::PointIds(const BrickGrid& bricks, const Box& positions)
    : bricks_(bricks),
      positions_(positions),
      all_{bricks.closed_box(positions.low).low, bricks.closed_box(positions.high).high} {}

void PointIds::make_faces() {
  const Index3 points = points_of_faces(bricks_.closed_box(positions_.low).size(), all_.size());
  for (int axis = 0; axis < 3; ++axis)
    if (positions_.size()[axis] > 1) faces_[axis].assign(static_cast<std::size_t>(points[axis]), none);
}

std::uint64_t PointIds::working_bytes(const BrickGrid& bricks, const Box& positions) {
  const PointIds ids(bricks, positions);
  const Box brick = bricks.closed_box(positions.low);
  const Index3 faces = points_of_faces(brick.size(), ids.all_.size());
  return static_cast<std::uint64_t>(brick.count() + faces.x + faces.y + faces.z) * sizeof(std::int64_t);
}

// The position of `p` in the face left behind along `axis`.
std::int64_t& PointIds::shared(int axis, Index3 p) {
  const Index3 q = p - box_.low, r = p - all_.low;
  const std::int64_t at = axis == 0   ? q.z * box_.size().y + q.y
                          : axis == 1 ? q.z * all_.size().x + r.x
                                      : r.y * all_.size().x + r.x;
  return faces_[axis][static_cast<std::size_t>(at)];
}

void PointIds::begin_brick(Index3 position) {
  if (position == positions_.low) make_faces();
  position_ = position;
  box_ = bricks_.closed_box(position);
  ids_.assign(static_cast<std::size_t>(box_.count()), none);
  for (int axis = 2; axis >= 0; --axis) {
    if (position[axis] == positions_.low[axis]) continue;
    Box face = box_;
    face.high[axis] = box_.low[axis];
    for_each_point_of(face, [&](Index3 p) { of(p) = shared(axis, p); });
  }
}

void PointIds::end_brick() {
  for (int axis = 0; axis < 3; ++axis) {
    if (position_[axis] == positions_.high[axis]) continue;
    Box face = box_;
    face.low[axis] = box_.high[axis];
    for_each_point_of(face, [&](Index3 p) { shared(axis, p) = of(p); });
  }
}

}  // namespace tagrid
