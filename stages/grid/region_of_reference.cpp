#include "stages/grid/region_of_reference.h"

#include <cassert>
#include <vector>

#include "stages/grid/lattice.h"

namespace tagrid {

LatticeBits region_of_reference(const Box& box, int cube_size) {
  assert(!box.empty());
  for (int axis = 0; axis < 3; ++axis) {
    assert(box.low[axis] % cube_size == 0 && box.high[axis] % cube_size == 0);
    (void)axis;
  }
  LatticeBits region(box.grown(cube_size));
  std::vector<Index3> open;
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
      for (std::int64_t x = box.low.x; x <= box.high.x; ++x) region.set({x, y, z});
  // Only points on the surface can have children outside, but visiting all points keeps the rule simple.
  const auto visit_children = [&](Index3 p) {
    for (Index3 child : children(p, classify(p, cube_size)))
      if (!region.test(child)) {
        region.set(child);
        open.push_back(child);
      }
  };
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
      for (std::int64_t x = box.low.x; x <= box.high.x; ++x) visit_children({x, y, z});
  while (!open.empty()) {
    const Index3 p = open.back();
    open.pop_back();
    visit_children(p);
  }
  return region;
}

}  // namespace tagrid
