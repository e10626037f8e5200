#include "stages/coarsen/coarsen.h"

#include <bit>
#include <cassert>

#include "stages/coarsen/leaf_test.h"
#include "stages/criterion/subdivide.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

template <class T>
class Refinement {
 public:
  Refinement(const Samples<T>& samples, const MeshBound& bound, LatticeBits& expanded, LatticeBits& active)
      : box_(active.box()),
        cube_size_(bound.cube_size),
        test_(samples, bound),
        expanded_(expanded),
        active_(active) {}

  void run() {
    do close_under_parents(active_, cube_size_);
    while (expand_new_points());
  }

 private:
  // Tests what the points that are new have created; false if there are none.
  bool expand_new_points() {
    bool any = false;
    for (std::int64_t z = box_.low.z; z <= box_.high.z; ++z)
      for (std::int64_t y = box_.low.y; y <= box_.high.y; ++y) {
        std::uint64_t *active = active_.row(y, z), *expanded = expanded_.row(y, z);
        for (std::size_t i = 0; i < active_.words_per_row(); ++i) {
          std::uint64_t left = active[i] & ~expanded[i];
          expanded[i] |= left;
          for (; left != 0; left &= left - 1, any = true)
            expand({box_.low.x + static_cast<std::int64_t>(64 * i) + std::countr_zero(left), y, z});
        }
      }
    return any;
  }

  void expand(Index3 p) {
    const PointClass c = classify(p, cube_size_);
    if (c.odd == 0) return expand_root(p);
    for (const Index3 child : children(p, c)) {
      if (!box_.contains(child) || active_.test(child)) continue;
      const Diamond around = diamond(child, classify(child, cube_size_), cube_size_);
      int at = 0;
      while (around.ring[at] != p) ++at;
      const int before = at == 0 ? around.size() - 1 : at - 1;
      if (violates(around, before, child) || violates(around, at, child)) active_.set(child);
    }
  }

  // The root tetrahedra of the cube whose low corner is this one.
  void expand_root(Index3 corner) {
    const std::int64_t half = cube_size_ / 2;
    const Index3 centre = corner + Index3{half, half, half};
    if (!box_.contains(centre) || active_.test(centre)) return;
    const Diamond roots = diamond(centre, classify(centre, cube_size_), cube_size_);
    for (int i = 0; i < roots.size(); ++i)
      if (violates(roots, i, centre)) return active_.set(centre);
  }

  // Tetrahedron i of the diamond of p. Those in other bricks are tested there.
  bool violates(const Diamond& around, int i, Index3 p) const {
    const Tetrahedron t = around.tetrahedron(i);
    if (!box_.contains(t.vertices[2]) || !box_.contains(t.vertices[3])) return false;
    return test_.violates(t.vertices, around.edge, p, classify(p, cube_size_).unit);
  }

  Box box_;
  int cube_size_;
  LeafTest<T> test_;
  LatticeBits& expanded_;
  LatticeBits& active_;
};

}  // namespace

void refine_to_bound(SampleType type, std::span<const std::byte> samples, const MeshBound& bound,
                     LatticeBits expanded, LatticeBits& active) {
  if (expanded.box() != active.box()) expanded = LatticeBits(active.box());
  with_sample_type(type, [&](auto sample) {
    using T = decltype(sample);
    assert(samples.size() == static_cast<std::size_t>(active.box().count()) * sizeof(T));
    const Samples<T> in_box{active.box(), reinterpret_cast<const T*>(samples.data())};
    Refinement<T>(in_box, bound, expanded, active).run();
  });
}

std::uint64_t working_bytes_of_refining(Index3 size) {
  return LatticeBits::working_bytes(size) + working_bytes_of_closure(size);
}

}  // namespace tagrid
