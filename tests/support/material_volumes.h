// Volumes with materials, and their meshes brick by brick.
#pragma once

#include <cmath>
#include <functional>
#include <map>
#include <stdexcept>
#include <vector>

#include "stages/grid/brick_grid.h"
#include "stages/materials/material_mesh.h"

namespace tagrid {

/// A volume, and the lattice of its mesh.
struct MaterialVolume {
  Index3 dims;
  std::array<double, 3> spacing{1, 1, 1};
  double edge = 2;  ///< H, in units of the spacing
  std::vector<float> thresholds{0.5F};
  int cube_size = 16;
  SnapRule rule = closest_vertices;
  std::vector<float> values;

  void fill(const std::function<double(double, double, double)>& value) {
    values.clear();
    for_each_point_of(Box::of_size(dims), [&](Index3 p) {
      values.push_back(static_cast<float>(value(static_cast<double>(p.x) * spacing[0],
                                                static_cast<double>(p.y) * spacing[1],
                                                static_cast<double>(p.z) * spacing[2])));
    });
  }
  SamplePlaces places() const {
    SamplePlaces p{dims, {}};
    for (std::size_t a = 0; a < 3; ++a) p.step[a] = edge / 2 / spacing[a];
    return p;
  }
  ValueField field() const { return {{Box::of_size(dims), values.data()}, places(), thresholds}; }
  MaterialLattice lattice() const {
    MaterialLattice l;
    l.cube_size = cube_size;
    for (int a = 0; a < 3; ++a)
      l.last[a] =
          2 * std::max<std::int64_t>(
                  1, std::llround(std::floor(static_cast<double>(dims[a] - 1) *
                                             spacing[static_cast<std::size_t>(a)] / edge * (1 + 1e-12))));
    return l;
  }
};

/// The tetrahedra of a volume, made in bricks of some root cubes.
struct MeshInMemory {
  struct Tetrahedron {
    std::array<std::int64_t, 4> vertices;
    Material material;
    bool all_snapped;
    friend auto operator<=>(const Tetrahedron&, const Tetrahedron&) = default;
  };
  std::map<std::int64_t, Index3>
      positions;  ///< of vertices, in parts of the lattice; by their numbers in the volume
  std::vector<Tetrahedron> tetrahedra;

  Index3 at(const Tetrahedron& t, std::size_t i) const { return positions.at(t.vertices[i]); }
};

inline MeshInMemory mesh_of(const MaterialVolume& volume, int bricks_edge = 1000) {
  const ValueField field = volume.field();
  const MaterialLattice lattice = volume.lattice();
  const BrickGrid bricks{lattice.domain(), bricks_edge};
  const BccBox all(lattice.box());
  MeshInMemory mesh;
  for (std::int64_t b = 0; b < bricks.count(); ++b) {
    const Box closed = bricks.closed_box(bricks.position(b));
    const PointMaterials points =
        materials_of_points(field, intersection(lattice.region(closed), lattice.box()));
    const LatticeBits active = activity_of_materials(points, lattice, closed);
    const Interface interface(field, points, active, lattice, lattice.surroundings(closed), volume.rule);
    for_each_material_tetrahedron(interface, active, lattice, closed, [&](const MaterialTetrahedron& t) {
      MeshInMemory::Tetrahedron& out = mesh.tetrahedra.emplace_back();
      for (std::size_t i = 0; i < 4; ++i) {
        const MeshVertex& v = t.vertices[i];
        out.vertices[i] = static_cast<std::int64_t>(all.number(v.point)) * (edges_of_point + 1) + v.edge + 1;
        const Index3 position = interface.position(v);
        const auto [place, is_new] = mesh.positions.emplace(out.vertices[i], position);
        if (!is_new && !(place->second == position)) throw std::runtime_error("a vertex has two positions");
      }
      out.material = t.material;
      out.all_snapped = t.all_snapped;
    });
  }
  return mesh;
}

}  // namespace tagrid
