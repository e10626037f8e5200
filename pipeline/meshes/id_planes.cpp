#include "pipeline/meshes/id_planes.h"

#include <algorithm>

#include "io/bytes/memory_size.h"

namespace tagrid {
namespace {

// The points on the lines where low and high faces of a brick meet: two lines along each axis.
std::size_t points_on_lines(Index3 brick) {
  return static_cast<std::size_t>(2 * (brick.x + brick.y + brick.z));
}

}  // namespace

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

std::uint64_t PointIds::working_bytes(const BrickGrid& bricks, const Box& positions) {
  const auto brick = static_cast<std::uint64_t>(bricks.closed_box(positions.low).count());
  return brick * sizeof(std::int64_t) + IdPlanes::working_bytes(bricks, positions, 1);
}

void PointIds::begin_brick(Index3 position) {
  planes_.begin_brick(position);
  ids_.assign(static_cast<std::size_t>(planes_.box().count()), none);
  for (int axis = 2; axis >= 0; --axis)
    if (planes_.has_low_face(axis))
      for_each_point_of(planes_.low_face(axis), [&](Index3 p) { of(p) = planes_.at(axis, p); });
}

void PointIds::end_brick() {
  for (int axis = 0; axis < 3; ++axis)
    if (planes_.has_high_face(axis))
      for_each_point_of(planes_.high_face(axis), [&](Index3 p) { planes_.at(axis, p) = of(p); });
}

std::uint64_t EdgeIds::working_bytes(const BrickGrid& bricks, const Box& positions) {
  const Index3 brick = 2 * bricks.closed_box(positions.low).size() - Index3{1, 1, 1};
  return points_on_lines(brick) * sizeof(inherited_.front()) + IdPlanes::working_bytes(bricks, positions, 2);
}

void EdgeIds::begin_brick(Index3 position) {
  planes_.begin_brick(position);
  inherited_.clear();
  inherited_.reserve(points_on_lines(planes_.box().size()));
  for (int high = 0; high < 3; ++high) {
    if (!planes_.has_high_face(high)) continue;
    for (int low = 0; low < 3; ++low) {
      if (low == high || !planes_.has_low_face(low)) continue;
      Box line = planes_.high_face(high);
      line.high[low] = line.low[low];
      for_each_point_of(line, [&](Index3 sum) {
        // Of a plane, only the ends of its lines are asked for here.
        const std::int64_t id = carried(sum);
        if (id != none) inherited_.emplace_back(sum, id);
      });
    }
  }
}

std::int64_t EdgeIds::carried(Index3 sum) const {
  for (int axis = 0; axis < 3; ++axis)
    if (sum[axis] == planes_.box().low[axis] && planes_.has_low_face(axis)) return planes_.at(axis, sum);
  return none;
}

bool EdgeIds::is_shared(Index3 sum) const {
  for (int axis = 0; axis < 3; ++axis)
    if (sum[axis] == planes_.box().high[axis] && planes_.has_high_face(axis)) return true;
  return false;
}

void EdgeIds::leave(Index3 sum, std::int64_t id) {
  for (int axis = 0; axis < 3; ++axis)
    if (sum[axis] == planes_.box().high[axis] && planes_.has_high_face(axis)) planes_.at(axis, sum) = id;
}

void EdgeIds::clear_high_faces() {
  planes_.clear_high_faces();
  for (const auto& [sum, id] : inherited_) leave(sum, id);
}

}  // namespace tagrid
