#include "stages/materials/material_lattice.h"

#include <array>
#include <cstddef>
#include <span>

#include "stages/criterion/subdivide.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

// The points of one parity, in rows along x.
void add_materials(const MaterialField& field, const Box& box, PointMaterials& result) {
  for (std::int64_t z = box.low.z; z <= box.high.z; z += 2)
    for (std::int64_t y = box.low.y; y <= box.high.y; y += 2) {
      const Index3 first{box.low.x, y, z};
      const auto row = static_cast<std::size_t>(box.high.x - box.low.x + 1);
      field.find_materials(first, std::span(result.numbers).subspan(result.points.number(first), row));
    }
}

// True if the center or a corner of a cube has another material.
bool has_several(const PointMaterials& materials, Index3 center) {
  const Material material = materials.at(center);
  for (int corner = 0; corner < 8; ++corner)
    if (materials.at(center + Index3{corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1}) !=
        material)
      return true;
  return false;
}

// No tetrahedron reaches beyond a plane where the lattice ends within root cubes: cubes of the largest edge that fits
// are cut into six.
void mark_end(const MaterialLattice& lattice, int axis, LatticeBits& marks) {
  const std::int64_t end = lattice.last[axis], edge = end & -end;
  if (edge >= lattice.cube_size || end > marks.box().high[axis] || end <= marks.box().low[axis]) return;
  Box centers = marks.box();
  for (int other = 0; other < 3; ++other) centers.low[other] += edge / 2;
  centers.low[axis] = centers.high[axis] = end - edge / 2;
  for_each_point_of(centers, edge, [&](Index3 p) {
    for (const Index3 parent : parents(p, classify(p, lattice.cube_size), lattice.cube_size))
      if (marks.box().contains(parent)) marks.set(parent);
  });
}

}  // namespace

PointMaterials materials_of_points(const MaterialField& field, const Box& box) {
  PointMaterials result{BccBox(box), {}};
  result.numbers.resize(result.points.count());
  add_materials(field, box, result);
  const Box centers{box.low + Index3{1, 1, 1}, box.high - Index3{1, 1, 1}};
  if (!centers.empty()) add_materials(field, centers, result);
  return result;
}

LatticeBits activity_of_materials(const PointMaterials& materials, const MaterialLattice& lattice,
                                  const Box& closed_box) {
  const Box region = lattice.region(closed_box);
  LatticeBits marks(region);
  const Box known = intersection(region, lattice.box());
  const Box centers{known.low + Index3{1, 1, 1}, known.high - Index3{1, 1, 1}};
  for_each_point_of(centers, 2, [&](Index3 center) {
    if (!has_several(materials, center)) return;
    marks.set(center);
    for (int axis = 0; axis < 3; ++axis)
      for (const std::int64_t step : {-2, 2}) {
        const Index3 neighbor = center + step * unit_vector(axis);
        if (centers.contains(neighbor)) marks.set(neighbor);
      }
  });
  for (int axis = 0; axis < 3; ++axis) mark_end(lattice, axis, marks);
  close_under_parents(marks, lattice.cube_size);
  return marks;
}

}  // namespace tagrid
