// Meshes with materials take at most the memory that they declare, and not much less.
#include <gtest/gtest.h>

#include "tests/support/counted_heap.h"
#include "tests/support/material_volumes.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

TEST(MaterialMeshWorkingBytes, OfEachBrickAreWhatItTakes) {
  if (sanitized) GTEST_SKIP() << "a sanitizer allocates in its own way";
  MaterialVolume volume{{75, 60, 66}};
  volume.edge = 1.5;
  volume.fill([](double x, double y, double z) { return x + y > z + 40 ? 1 : 0; });
  const ValueField field = volume.field();
  for (const int cube_size : {4, 8, 32}) {
    volume.cube_size = cube_size;
    const MaterialLattice lattice = volume.lattice();
    const BrickGrid bricks{lattice.domain(), 64 / cube_size};
    for (std::int64_t b = 0; b < bricks.count(); ++b) {
      const Box closed = bricks.closed_box(bricks.position(b));
      std::int64_t tetrahedra = 0;
      const HeapPeak peak;
      {
        const PointMaterials points =
            materials_of_points(field, intersection(lattice.region(closed), lattice.box()));
        const LatticeBits active = activity_of_materials(points, lattice, closed);
        const Interface interface(field, points, active, lattice, lattice.surroundings(closed));
        for_each_material_tetrahedron(interface, active, lattice, closed,
                                      [&](const MaterialTetrahedron&) { ++tetrahedra; });
      }
      EXPECT_GT(tetrahedra, 0);
      EXPECT_LE(peak.bytes(), working_bytes_of_material_mesh(lattice, closed)) << cube_size << ' ' << b;
      EXPECT_GT(1.05 * static_cast<double>(peak.bytes()),
                static_cast<double>(working_bytes_of_material_mesh(lattice, closed)))
          << cube_size << ' ' << b;
    }
  }
}

}  // namespace
}  // namespace tagrid
