// The part of a mesh with materials in a brick takes at most the memory that it declares, even of noise, the worst
// input, and not much less then.
#include <gtest/gtest.h>

#include <random>

#include "stages/materials/brick_mesh.h"
#include "tests/support/counted_heap.h"
#include "tests/support/material_volumes.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

// Volumes of 48 cubes along each axis, in bricks of the lattice's own size, and of 20 in a root cube that is larger.
TEST(BrickMeshWorkingBytes, AreThoseOfNoise) {
  if (sanitized) GTEST_SKIP() << "a sanitizer allocates in its own way";
  struct Shape {
    double edge, cubes;
    int cube_size;
  };
  double most = 0, most_kept = 0;
  for (const auto& [edge, cubes, cube_size] : {Shape{1, 48, 16}, {2, 48, 16}, {1, 20, 128}})
    for (const auto& thresholds : {std::vector<float>{0.5F}, std::vector<float>{0.25F, 0.5F, 0.75F}})
      for (const int order : {1, 2}) {
        std::mt19937 random(7);
        MaterialVolume volume{{33, 33, 33}};
        for (int axis = 0; axis < 3; ++axis) volume.dims[axis] = 1 + static_cast<std::int64_t>(cubes * edge);
        volume.edge = edge;
        volume.cube_size = cube_size;
        volume.thresholds = thresholds;
        volume.fill([&](double, double, double) { return static_cast<double>(random() % 1000) / 1000; });
        MaterialMeshSettings settings{
            volume.lattice(), std::vector<bool>(4, true), {}, closest_vertices, order, {}, {}, false};
        for (std::size_t a = 0; a < 3; ++a) settings.directions[a][a] = edge / 2 / parts_per_point;
        const Box closed =
            BrickGrid{settings.lattice.domain(), std::max(64 / cube_size, 1)}.closed_box({0, 0, 0});
        const ValueField field = volume.field();
        const HeapPeak peak;
        const BrickMesh mesh = mesh_of_brick(field, settings, closed);
        const auto bytes = static_cast<double>(working_bytes_of_brick_mesh(settings, closed));
        const auto taken = static_cast<double>(peak.bytes());
        EXPECT_LE(taken, bytes) << edge << ' ' << order;
        EXPECT_LE(mesh.bytes(), bytes_of_brick_mesh(settings, closed)) << edge << ' ' << order;
        EXPECT_GT(taken / bytes, cube_size == 128 ? 0.5 : 0.6) << edge << ' ' << order;
        most = std::max(most, taken / bytes);
        most_kept = std::max(most_kept, static_cast<double>(mesh.bytes()) /
                                            static_cast<double>(bytes_of_brick_mesh(settings, closed)));
      }
  EXPECT_GT(most, 0.8);
  EXPECT_GT(most_kept, 0.8);
}

}  // namespace
}  // namespace tagrid
