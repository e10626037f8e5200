#include "pipeline/surface/edge_ids.h"

#include <algorithm>

namespace tagrid {
namespace {

Box doubled(const Box& box) { return {2 * box.low, 2 * box.high}; }

template <class Visit>
void for_each_point_of(const Box& box, Visit visit) {
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
      for (std::int64_t x = box.low.x; x <= box.high.x; ++x) visit(Index3{x, y, z});
}

// The points of the planes that are left behind along each axis.
Index3 points_of_planes(Index3 brick, Index3 all) {
  return {brick.y * brick.z, all.x * brick.z, all.x * all.y};
}

}  // namespace

EdgeIds::EdgeIds(const BrickGrid& bricks, const Box& positions)
    : bricks_(bricks),
      positions_(positions),
      all_(doubled({bricks.closed_box(positions.low).low, bricks.closed_box(positions.high).high})) {}

void EdgeIds::make_planes() {
  const Index3 brick = doubled(bricks_.closed_box(positions_.low)).size();
  const Index3 points = points_of_planes(brick, all_.size());
  for (int axis = 0; axis < 3; ++axis)
    if (positions_.size()[axis] > 1) planes_[axis].assign(static_cast<std::size_t>(points[axis]), none);
  inherited_.reserve(static_cast<std::size_t>(2 * (brick.x + brick.y + brick.z)));
}

std::uint64_t EdgeIds::working_bytes(const BrickGrid& bricks, const Box& positions) {
  const EdgeIds ids(bricks, positions);
  const Index3 brick = doubled(bricks.closed_box(positions.low)).size();
  const Index3 points = points_of_planes(brick, ids.all_.size());
  std::uint64_t bytes =
      static_cast<std::uint64_t>(2 * (brick.x + brick.y + brick.z)) * sizeof(inherited_.front());
  for (int axis = 0; axis < 3; ++axis)
    if (positions.size()[axis] > 1) bytes += static_cast<std::uint64_t>(points[axis]) * sizeof(std::int64_t);
  return bytes;
}

std::size_t EdgeIds::place(int axis, Index3 sum) const {
  const Index3 q = sum - box_.low, r = sum - all_.low;
  const std::int64_t at = axis == 0   ? q.z * box_.size().y + q.y
                          : axis == 1 ? q.z * all_.size().x + r.x
                                      : r.y * all_.size().x + r.x;
  return static_cast<std::size_t>(at);
}

void EdgeIds::begin_brick(Index3 position) {
  if (position == positions_.low) make_planes();
  position_ = position;
  box_ = doubled(bricks_.closed_box(position));
  inherited_.clear();
  for (int high = 0; high < 3; ++high) {
    if (position[high] == positions_.high[high]) continue;
    for (int low = 0; low < 3; ++low) {
      if (low == high || position[low] == positions_.low[low]) continue;
      Box line = box_;
      line.low[high] = box_.high[high];
      line.high[low] = box_.low[low];
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
    if (sum[axis] == box_.low[axis] && position_[axis] != positions_.low[axis])
      return planes_[axis][place(axis, sum)];
  return none;
}

bool EdgeIds::is_shared(Index3 sum) const {
  for (int axis = 0; axis < 3; ++axis)
    if (sum[axis] == box_.high[axis] && position_[axis] != positions_.high[axis]) return true;
  return false;
}

void EdgeIds::leave(Index3 sum, std::int64_t id) {
  for (int axis = 0; axis < 3; ++axis)
    if (sum[axis] == box_.high[axis] && position_[axis] != positions_.high[axis])
      planes_[axis][place(axis, sum)] = id;
}

void EdgeIds::clear_high_faces() {
  for (int axis = 0; axis < 3; ++axis) {
    if (position_[axis] == positions_.high[axis]) continue;
    // Row by row: along y in the plane of x, else along x.
    const int along = axis == 0 ? 1 : 0;
    Box starts = box_;
    starts.low[axis] = box_.high[axis];
    starts.high[along] = box_.low[along];
    for_each_point_of(starts, [&](Index3 start) {
      std::fill_n(&planes_[axis][place(axis, start)], box_.size()[along], none);
    });
  }
  for (const auto& [sum, id] : inherited_) leave(sum, id);
}

}  // namespace tagrid
