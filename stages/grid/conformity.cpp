#include "stages/grid/conformity.h"

#include <cassert>
#include <vector>

#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

bool obeys_the_law(const LatticeBits& active, const Box& looked_at, Index3 p, int cube_size) {
  const PointClass c = classify(p, cube_size);
  if (c.odd == 0) return active.test(p);
  if (!active.test(p)) return true;
  for (Index3 parent : parents(p, c, cube_size))
    if (looked_at.contains(parent) && !active.test(parent)) return false;
  return true;
}

}  // namespace

std::optional<Index3> first_nonconforming_point(const LatticeBits& active, const Box& domain, int cube_size) {
  const Box box = intersection(active.box(), domain);
  if (box.empty()) return std::nullopt;
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y) {
      const bool has_root_corners = (y | z) % cube_size == 0;
      for (std::int64_t x = box.low.x; x <= box.high.x; ++x) {
        const bool may_break = active.test({x, y, z}) || (has_root_corners && x % cube_size == 0);
        if (may_break && !obeys_the_law(active, box, {x, y, z}, cube_size)) return Index3{x, y, z};
      }
    }
  return std::nullopt;
}

bool is_conforming(const LatticeBits& active, const Box& domain, int cube_size) {
  return !first_nonconforming_point(active, domain, cube_size).has_value();
}

LatticeBits region_of_reference(const Box& box, int cube_size) {
  assert(!box.empty());
  for (int axis = 0; axis < 3; ++axis) {
    assert(box.low[axis] % cube_size == 0 && box.high[axis] % cube_size == 0);
    (void)axis;
  }
  LatticeBits region(box.grown(cube_size));
  std::vector<Index3> open;
  for_each_point_of(box, [&](Index3 p) { region.set(p); });
  // Only points on the surface can have children outside, but visiting all points keeps the rule simple.
  const auto visit_children = [&](Index3 p) {
    for (Index3 child : children(p, classify(p, cube_size)))
      if (!region.test(child)) {
        region.set(child);
        open.push_back(child);
      }
  };
  for_each_point_of(box, visit_children);
  while (!open.empty()) {
    const Index3 p = open.back();
    open.pop_back();
    visit_children(p);
  }
  return region;
}

}  // namespace tagrid
