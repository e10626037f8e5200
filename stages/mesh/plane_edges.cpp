#include "stages/mesh/plane_edges.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <utility>

#include "stages/grid/lattice.h"
#include "stages/mesh/tetrahedra.h"

namespace tagrid {
namespace {

class PlaneCut {
 public:
  PlaneCut(const LatticeBits& active, int cube_size, int axis, std::int64_t at)
      : active_(active), cube_size_(cube_size), deepest_(max_level(cube_size)), axis_(axis), at_(at) {}

  std::vector<PlaneEdge> edges() && {
    const Box& box = active_.box();
    Box cubes = {box.low, box.high - cube_size_ * Index3{1, 1, 1}};
    // Those on both sides of a plane between cubes have the same edges in it.
    cubes.low[axis_] =
        std::min(box.low[axis_] + (at_ - box.low[axis_]) / cube_size_ * cube_size_, cubes.high[axis_]);
    cubes.high[axis_] = cubes.low[axis_];
    for_each_point_of(cubes, cube_size_, [&](Index3 corner) {
      for (const BisectionStep& root : root_tetrahedra(corner, cube_size_)) visit(root);
    });
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
    return std::move(edges_);
  }

 private:
  void visit(const BisectionStep& step) {
    std::int64_t low = step.vertices[0][axis_], high = low;
    for (const Index3& vertex : step.vertices) {
      low = std::min(low, vertex[axis_]);
      high = std::max(high, vertex[axis_]);
    }
    if (at_ < low || high < at_) return;
    if (step.level < deepest_) {
      const Index3 middle = step.midpoint();
      if (active_.test(middle)) {
        visit(step.half(middle, 0));
        visit(step.half(middle, 1));
        return;
      }
    }
    for (std::size_t without = 0; without < 4; ++without) add_face(step.vertices, without);
  }

  // The edge where a face meets the plane. The edges of a face in the plane are those of other faces, and a
  // face that only touches the plane in a point has none.
  void add_face(const std::array<Index3, 4>& vertices, std::size_t without) {
    std::array<Index3, 3> met;
    std::size_t count = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      if (i == without) continue;
      const Index3 a = vertices[i];
      if (a[axis_] == at_) met[count++] = a;
      for (std::size_t j = i + 1; j < 4; ++j) {
        const Index3 way = vertices[j] - a;
        const std::int64_t before = at_ - a[axis_], after = vertices[j][axis_] - at_;
        if (j == without || before == 0 || after == 0 || (before > 0) != (after > 0)) continue;
        const Index3 scaled = before * way;
        met[count++] = a + Index3{scaled.x / way[axis_], scaled.y / way[axis_], scaled.z / way[axis_]};
      }
    }
    if (count != 2) return;
    const PlaneEdge edge = {place_of(met[0]), place_of(met[1])};
    edges_.push_back(edge.from < edge.to ? edge : PlaneEdge{edge.to, edge.from});
  }

  PlacePlane place_of(Index3 p) const { return {p[axis_ == 0 ? 1 : 0], p[axis_ == 2 ? 1 : 2]}; }

  const LatticeBits& active_;
  int cube_size_, deepest_, axis_;
  std::int64_t at_;
  std::vector<PlaneEdge> edges_;
};

}  // namespace

std::vector<PlaneEdge> edges_in_plane(const LatticeBits& active, int cube_size, int axis, std::int64_t at) {
  assert(active.box().low[axis] <= at && at <= active.box().high[axis]);
  return PlaneCut(active, cube_size, axis, at).edges();
}

}  // namespace tagrid
