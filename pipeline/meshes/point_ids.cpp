#include "pipeline/meshes/point_ids.h"

namespace tagrid {

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

}  // namespace tagrid
