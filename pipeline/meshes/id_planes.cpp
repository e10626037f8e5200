#include "pipeline/meshes/id_planes.h"
#include "io/bytes/memory_size.h"

#include <algorithm>

namespace tagrid {

IdPlanes::IdPlanes(const BrickGrid& bricks, const Box& positions, int scale)
    : bricks_(bricks),
      positions_(positions),
      scale_(scale),
      all_(scaled({bricks.closed_box(positions.low).low, bricks.closed_box(positions.high).high})) {}

Box IdPlanes::scaled(const Box& box) const { return {scale_ * box.low, scale_ * box.high}; }

Index3 IdPlanes::points_of_planes() const {
  const Index3 brick = scaled(bricks_.closed_box(positions_.low)).size(), all = all_.size();
  return {brick.y * brick.z, all.x * brick.z, all.x * all.y};
}

std::uint64_t IdPlanes::working_bytes(const BrickGrid& bricks, const Box& positions, int scale) {
  const Index3 points = IdPlanes(bricks, positions, scale).points_of_planes();
  std::uint64_t bytes = 0;
  for (int axis = 0; axis < 3; ++axis)
    if (positions.size()[axis] > 1) bytes += static_cast<std::uint64_t>(points[axis]) * sizeof(std::int64_t);
  return bytes;
}

void IdPlanes::begin_brick(Index3 position) {
  if (position == positions_.low) {
    const Index3 points = points_of_planes();
    for (int axis = 0; axis < 3; ++axis)
      if (positions_.size()[axis] > 1)
        planes_[axis].assign(memory_size(static_cast<std::uint64_t>(points[axis])), none);
  }
  position_ = position;
  box_ = scaled(bricks_.closed_box(position));
}

Box IdPlanes::low_face(int axis) const {
  Box face = box_;
  face.high[axis] = box_.low[axis];
  return face;
}

Box IdPlanes::high_face(int axis) const {
  Box face = box_;
  face.low[axis] = box_.high[axis];
  return face;
}

std::size_t IdPlanes::place(int axis, Index3 p) const {
  const Index3 q = p - box_.low, r = p - all_.low;
  const std::int64_t at = axis == 0   ? q.z * box_.size().y + q.y
                          : axis == 1 ? q.z * all_.size().x + r.x
                                      : r.y * all_.size().x + r.x;
  return static_cast<std::size_t>(at);
}

void IdPlanes::clear_high_faces() {
  for (int axis = 0; axis < 3; ++axis) {
    if (!has_high_face(axis)) continue;
    // Row by row: along y in the plane of x, else along x.
    const int along = axis == 0 ? 1 : 0;
    Box starts = high_face(axis);
    starts.high[along] = box_.low[along];
    for_each_point_of(starts, [&](Index3 start) { std::fill_n(&at(axis, start), box_.size()[along], none); });
  }
}

}  // namespace tagrid
