#include "stages/materials/material_mesh.h"

#include "stages/criterion/subdivide.h"
#include "stages/materials/dihedral_angles.h"

namespace tagrid {

double badness_of(const Interface& interface, const MaterialTetrahedron& t) {
  std::array<std::array<double, 3>, 4> v;
  const Index3 first = interface.position(t.vertices[0]);
  for (std::size_t i = 0; i < 4; ++i) {
    // Differences are exact.
    const Index3 d = interface.position(t.vertices[i]) - first;
    v[i] = {static_cast<double>(d.x), static_cast<double>(d.y), static_cast<double>(d.z)};
  }
  return largest_cosine(v);
}

std::uint64_t working_bytes_of_material_mesh(const MaterialLattice& lattice, const Box& closed_box) {
  const Box region = lattice.region(closed_box), of_points = intersection(region, lattice.box());
  return BccBox(of_points).count() * sizeof(Material) + LatticeBits::working_bytes(region.size()) +
         std::max(working_bytes_of_closure(region.size()),
                  Interface::working_bytes(lattice.surroundings(closed_box)));
}

}  // namespace tagrid
