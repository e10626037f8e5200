// A surface takes no more memory than it states, and what it states is not much more than noise takes.
#include <gtest/gtest.h>

#include <random>

#include "stages/surface/surface.h"
#include "tests/support/counted_heap.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

template <class T>
void check(int cube, Index3 cubes, Index3 cut) {
  const Box box{{0, 0, 0}, {cubes.x * cube, cubes.y * cube, cubes.z * cube}};
  LatticeBits active(box);
  std::vector<T> points(static_cast<std::size_t>(box.count()));
  std::mt19937_64 random(1);
  for (std::int64_t z = 0; z <= box.high.z; ++z)
    for (std::int64_t y = 0; y <= box.high.y; ++y)
      for (std::int64_t x = 0; x <= box.high.x; ++x) {
        active.set(Index3{x, y, z});
        // Edges along the axes, of which there are three at a point, always change sides; others, often.
        const bool odd = (x + y + z) % 2 != 0 || random() % 8 == 0;
        points[static_cast<std::size_t>(box.offset({x, y, z}))] = static_cast<T>(odd ? 100 : 0);
      }
  for (const bool close : {false, true}) {
    const SurfaceGrid grid{cube, box.high - cut, std::nullopt, close};
    const HeapPeak peak;
    const BrickSurface surface = surface_of_brick<T>(points, active, grid, {50});
    const std::uint64_t stated = working_bytes_of_surface(sample_type_of<T>(), box.size(), cube);
    EXPECT_LE(peak.bytes(), stated) << name_of(sample_type_of<T>()) << ", " << cube << ", " << close;
    // Small bricks have many points on their faces, where edges are fewer.
    if (cube >= 16) {
      EXPECT_LE(static_cast<double>(stated), 2.5 * static_cast<double>(peak.bytes()))
          << cube << ", " << close;
    }
    EXPECT_LE(surface.vertices.size(), most_surface_vertices(box.size()));
    EXPECT_LE(surface.triangles.size(), most_surface_triangles(box.size()));
  }
}

TEST(SurfaceBytes, AreWhatIsStatedForNoise) {
  if (sanitized) GTEST_SKIP() << "a sanitizer allocates in its own way";
  check<std::uint8_t>(32, {2, 2, 2}, {0, 0, 0});
  check<std::int16_t>(8, {2, 3, 2}, {3, 1, 7});
  check<float>(16, {2, 1, 2}, {0, 0, 1});
  check<double>(4, {2, 2, 2}, {3, 3, 3});
}

}  // namespace
}  // namespace tagrid
