#include "pipeline/meshes/edge_ids.h"

namespace tagrid {
namespace {

// The points on the lines where low and high faces of a brick meet: two lines along each axis.
std::size_t points_on_lines(Index3 brick) {
  return static_cast<std::size_t>(2 * (brick.x + brick.y + brick.z));
}

}  // namespace

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
