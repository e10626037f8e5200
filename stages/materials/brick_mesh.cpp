#include "stages/materials/brick_mesh.h"

#include <algorithm>
#include <cmath>

#include "stages/materials/dihedral_angles.h"
#include "stages/materials/interface.h"
#include "stages/materials/material_mesh.h"

namespace tagrid {
namespace {

using Vector = std::array<double, 3>;

Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vector cross_of(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot_of(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// The corners of the edges of an element, in the order of its middle nodes.
constexpr std::array<std::array<std::size_t, 2>, 6> edges_of_element = {
    {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};

// The most that a cube of edge H had of noise, the worst input; see tests/stages/materials/brick_mesh_bytes_test.cpp.
struct OfCube {
  std::uint64_t elements, vertices, vertices_and_middles, faces, candidates;
};
constexpr OfCube of_noise = {16, 3, 22, 11, 44};

// A root cube may be much larger than the volume.
std::uint64_t cubes_of(const MaterialLattice& lattice, const Box& closed_box) {
  const Box within = intersection(closed_box, lattice.box());
  const Index3 size = within.high - within.low;
  return static_cast<std::uint64_t>(size.x * size.y * size.z / 8);
}

// The face between two sides, or nothing if it is within a material or between materials that are not kept.
std::optional<BrickMesh::Face> joined(const BrickMesh::ElementFace& a, const BrickMesh::ElementFace& b,
                                      double area) {
  const bool has_a = a.element != BrickMesh::none, has_b = b.element != BrickMesh::none;
  if (a.material == b.material || (!has_a && !has_b)) return std::nullopt;
  const bool a_is_front = first_is_front(has_a, a.material, has_b, b.material);
  return BrickMesh::Face{a_is_front ? a : b, a_is_front ? b : a, true, BrickMesh::no_side, area};
}

Box with_next(const Box& points) { return {points.low, points.high + Index3{2, 2, 2}}; }

class Builder {
 public:
  Builder(const Interface& interface, const MaterialMeshSettings& settings, const Box& closed_box)
      : interface_(interface),
        settings_(settings),
        all_(settings.lattice.box()),
        own_{closed_box.low + Index3{2, 2, 2}, closed_box.high - Index3{1, 1, 1}},
        near_(with_next(intersection(closed_box, settings.lattice.box()))),
        places_(near_.count() * vertices_of_point, BrickMesh::none) {
    // Nothing lies beyond the ends of the volume.
    for (int axis = 0; axis < 3; ++axis) {
      if (closed_box.low[axis] <= 0) own_.low[axis] = 0;
      if (closed_box.high[axis] >= settings.lattice.last[axis]) own_.high[axis] = settings.lattice.last[axis];
    }
    // Pages that stay empty are none, and vectors that grow would take three times as much.
    const std::uint64_t cubes = cubes_of(settings.lattice, closed_box);
    mesh_.elements.reserve(of_noise.elements * cubes);
    mesh_.nodes.reserve((settings.order == 1 ? of_noise.vertices : of_noise.vertices_and_middles) * cubes);
    mesh_.faces.reserve(of_noise.faces * cubes);
    candidates_.reserve(of_noise.candidates * cubes);
  }

  void add(const MaterialTetrahedron& t) {
    std::array<Index3, 4> positions;
    for (std::size_t i = 0; i < 4; ++i) positions[i] = interface_.position(t.vertices[i]);
    const bool is_cut_off = settings_.region && !is_inside_region(positions);
    if (is_cut_off && !meets_region(positions)) return;
    Corners corners{t.vertices, positions, {}};
    if (settings_.is_mirrored) {
      std::swap(corners.vertices[2], corners.vertices[3]);
      std::swap(corners.positions[2], corners.positions[3]);
    }
    for (std::size_t i = 0; i < 4; ++i) corners.world[i] = settings_.world(corners.positions[i]);
    const std::uint32_t element =
        settings_.keeps(t.material) ? add_element(corners, t.material) : BrickMesh::none;
    for (std::uint8_t corner = 0; corner < 4; ++corner)
      look_at_face(corners, {element, corner, t.material}, is_cut_off);
  }

  BrickMesh finish() {
    join_faces();
    if (settings_.order == 2) add_middles();
    number_parts();
    mesh_.nodes.shrink_to_fit();
    mesh_.elements.shrink_to_fit();
    mesh_.faces.shrink_to_fit();
    return std::move(mesh_);
  }

 private:
  static constexpr std::size_t vertices_of_point = edges_of_point + 1;

  struct Corners {
    std::array<MeshVertex, 4> vertices;
    std::array<Index3, 4> positions;
    std::array<Vector, 4> world;
  };

  std::uint64_t key_of(const MeshVertex& v) const {
    return static_cast<std::uint64_t>(all_.number(v.point)) * vertices_of_point +
           static_cast<std::uint64_t>(v.edge + 1);
  }
  bool is_on_interface(const MeshVertex& v) const { return v.edge >= 0 || interface_.is_snapped(v.point); }

  template <std::size_t n>
  static Box bounds(const std::array<Index3, n>& positions) {
    Box box{positions[0], positions[0]};
    for (const Index3& p : positions)
      for (int axis = 0; axis < 3; ++axis) {
        box.low[axis] = std::min(box.low[axis], p[axis]);
        box.high[axis] = std::max(box.high[axis], p[axis]);
      }
    return box;
  }
  bool meets_region(const std::array<Index3, 4>& positions) const {
    return !intersection(bounds(positions), *settings_.region).empty();
  }
  template <std::size_t n>
  bool is_inside_region(const std::array<Index3, n>& positions) const {
    return settings_.region->contains(bounds(positions));
  }

  std::uint32_t add_element(const Corners& corners, Material material) {
    const auto number = static_cast<std::uint32_t>(mesh_.elements.size());
    BrickMesh::Element& element = mesh_.elements.emplace_back();
    element.material = material;
    sets_.add();
    for (std::size_t i = 0; i < 4; ++i) {
      const std::uint32_t node = node_of(corners, i);
      element.nodes[i] = node;
      // All tetrahedra around a vertex within a material are connected; around one outside of the region, some are
      // missing.
      if (is_on_interface(corners.vertices[i])) continue;
      if (settings_.region && !settings_.region->contains(corners.positions[i])) continue;
      std::uint32_t& first = mesh_.nodes[node].part;  // the element, until parts are numbered
      if (first == BrickMesh::none)
        first = number;
      else
        sets_.join(first, number);
    }
    const auto& w = corners.world;
    const Vector a = minus(w[1], w[0]), b = minus(w[2], w[0]), c = minus(w[3], w[0]);
    element.volume = dot_of(a, cross_of(b, c)) / 6;
    const AngleRange angles = dihedral_angles(w);
    element.smallest_angle = static_cast<float>(angles.smallest);
    element.largest_angle = static_cast<float>(angles.largest);
    return number;
  }

  std::uint32_t node_of(const Corners& corners, std::size_t i) {
    const MeshVertex& v = corners.vertices[i];
    std::uint32_t& place =
        places_[near_.number(v.point) * vertices_of_point + static_cast<std::size_t>(v.edge + 1)];
    if (place == BrickMesh::none) {
      place = static_cast<std::uint32_t>(mesh_.nodes.size());
      const std::uint64_t key = key_of(v);
      mesh_.nodes.push_back(
          {{key, key}, corners.world[i], v.point.z, BrickMesh::none, !own_.contains(v.point)});
    }
    return place;
  }

  // Faces within a material are not needed. All others are between vertices on interfaces, or at an end.
  void look_at_face(const Corners& corners, const BrickMesh::ElementFace& face, bool is_cut_off) {
    std::array<std::size_t, 3> of_face{};
    for (std::size_t i = 0, k = 0; i < 4; ++i)
      if (i != face.corner) of_face[k++] = i;
    const int side = side_of(corners, of_face);
    if (side != BrickMesh::no_side) {
      if (face.element != BrickMesh::none)
        mesh_.faces.push_back({face, {}, false, static_cast<std::int8_t>(side), area_of(corners, of_face)});
      return;
    }
    const bool is_between = std::all_of(of_face.begin(), of_face.end(),
                                        [&](std::size_t i) { return is_on_interface(corners.vertices[i]); });
    // Both tetrahedra of a face that is inside of the region are there.
    const bool may_end_region =
        is_cut_off &&
        !is_inside_region(std::array<Index3, 3>{corners.positions[of_face[0]], corners.positions[of_face[1]],
                                                corners.positions[of_face[2]]});
    if (!is_between && (!may_end_region || face.element == BrickMesh::none)) return;
    BrickMesh::OpenFace& open = candidates_.emplace_back();
    open.face = face;
    open.area = area_of(corners, of_face);
    open.may_end_region = may_end_region;
    for (std::size_t k = 0; k < 3; ++k) {
      const MeshVertex& v = corners.vertices[of_face[k]];
      open.vertices[k] = key_of(v);
      open.z = std::max(open.z, v.point.z);
    }
    std::sort(open.vertices.begin(), open.vertices.end());
  }

  int side_of(const Corners& corners, const std::array<std::size_t, 3>& of_face) const {
    for (int axis = 0; axis < 3; ++axis)
      for (int end = 0; end < 2; ++end) {
        const std::int64_t plane = end == 0 ? 0 : settings_.lattice.last[axis] * parts_per_point;
        if (std::all_of(of_face.begin(), of_face.end(),
                        [&](std::size_t i) { return corners.positions[i][axis] == plane; }))
          return 2 * axis + end;
      }
    return BrickMesh::no_side;
  }

  static double area_of(const Corners& corners, const std::array<std::size_t, 3>& of_face) {
    const auto& w = corners.world;
    const Vector n = cross_of(minus(w[of_face[1]], w[of_face[0]]), minus(w[of_face[2]], w[of_face[0]]));
    return std::sqrt(dot_of(n, n)) / 2;
  }

  void join_faces() {
    std::stable_sort(
        candidates_.begin(), candidates_.end(),
        [](const BrickMesh::OpenFace& a, const BrickMesh::OpenFace& b) { return a.vertices < b.vertices; });
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      if (i + 1 == candidates_.size() || candidates_[i].vertices != candidates_[i + 1].vertices) {
        mesh_.open_faces.push_back(candidates_[i]);
        continue;
      }
      const BrickMesh::ElementFace &a = candidates_[i].face, &b = candidates_[i + 1].face;
      if (const auto face = joined(a, b, candidates_[i].area))
        mesh_.faces.push_back(*face);
      else if (a.element != BrickMesh::none)
        sets_.join(a.element, b.element);
      ++i;
    }
    candidates_.clear();
    candidates_.shrink_to_fit();
  }

  void add_middles() {
    // The middle of an edge belongs to its lower node: lists of other ends and middles.
    struct Middle {
      std::uint32_t other, node;
    };
    std::vector<std::vector<Middle>> middles(mesh_.nodes.size());
    for (BrickMesh::Element& element : mesh_.elements)
      for (std::size_t e = 0; e < edges_of_element.size(); ++e) {
        const auto [a, b] =
            std::minmax(element.nodes[edges_of_element[e][0]], element.nodes[edges_of_element[e][1]]);
        std::vector<Middle>& of_a = middles[a];
        const std::uint32_t other = b;
        auto found =
            std::find_if(of_a.begin(), of_a.end(), [&](const Middle& m) { return m.other == other; });
        if (found == of_a.end()) {
          found = of_a.insert(of_a.end(), {other, static_cast<std::uint32_t>(mesh_.nodes.size())});
          mesh_.nodes.push_back(middle_of(mesh_.nodes[a], mesh_.nodes[b]));
        }
        element.nodes[4 + e] = found->node;
      }
  }
  static BrickMesh::Node middle_of(const BrickMesh::Node& a, const BrickMesh::Node& b) {
    BrickMesh::Node middle;
    middle.key = {std::min(a.key.first, b.key.first), std::max(a.key.first, b.key.first)};
    for (std::size_t i = 0; i < 3; ++i) middle.world[i] = (a.world[i] + b.world[i]) / 2;
    middle.z = std::max(a.z, b.z);
    middle.is_shared = a.is_shared && b.is_shared;
    return middle;
  }

  void number_parts() {
    std::vector<std::uint32_t> numbers(mesh_.elements.size());
    for (std::uint32_t i = 0; i < mesh_.elements.size(); ++i) {
      BrickMesh::Element& element = mesh_.elements[i];
      const std::uint32_t root = sets_.root(i);
      if (root == i) {
        numbers[i] = static_cast<std::uint32_t>(mesh_.parts.size());
        mesh_.parts.push_back({element.material, 0});
      }
      element.part = numbers[root];
      mesh_.parts[element.part].volume += element.volume;
    }
    for (BrickMesh::Node& node : mesh_.nodes)
      if (node.part != BrickMesh::none) node.part = mesh_.elements[node.part].part;
  }

  const Interface& interface_;
  const MaterialMeshSettings& settings_;
  BccBox all_;
  Box own_;                            ///< vertices at these points are those of no other brick
  BccBox near_;                        ///< the next one is by its numbers, and by edges
  std::vector<std::uint32_t> places_;  ///< of vertices in mesh_.nodes
  ConnectedSets sets_;
  std::vector<BrickMesh::OpenFace> candidates_;  ///< all faces that may be at the end of a material
  BrickMesh mesh_;
};

}  // namespace

BrickMesh mesh_of_brick(const MaterialField& field, const MaterialMeshSettings& settings,
                        const Box& closed_box) {
  const MaterialLattice& lattice = settings.lattice;
  const PointMaterials materials =
      materials_of_points(field, intersection(lattice.region(closed_box), lattice.box()));
  const LatticeBits active = activity_of_materials(materials, lattice, closed_box);
  const Interface interface(field, materials, active, lattice, lattice.surroundings(closed_box),
                            settings.rule);
  Builder builder(interface, settings, closed_box);
  for_each_material_tetrahedron(interface, active, lattice, closed_box,
                                [&](const MaterialTetrahedron& t) { builder.add(t); });
  return builder.finish();
}

std::uint64_t bytes_of_brick_mesh(const MaterialMeshSettings& settings, const Box& closed_box) {
  // Where a cube has most elements, it does not have most faces.
  const std::uint64_t nodes = settings.order == 1 ? of_noise.vertices : of_noise.vertices_and_middles;
  return cubes_of(settings.lattice, closed_box) *
         (of_noise.elements * sizeof(BrickMesh::Element) + nodes * sizeof(BrickMesh::Node) +
          of_noise.faces / 2 * sizeof(BrickMesh::Face));
}

std::uint64_t working_bytes_of_brick_mesh(const MaterialMeshSettings& settings, const Box& closed_box) {
  // A node has a list of its middles and a number in the lattice, an element is in a set; the rest was measured.
  const std::uint64_t lists = settings.order == 1 ? 0 : 350, others = 1200;
  return working_bytes_of_material_mesh(settings.lattice, closed_box) +
         bytes_of_brick_mesh(settings, closed_box) +
         cubes_of(settings.lattice, closed_box) *
             (of_noise.faces / 2 * sizeof(BrickMesh::Face) +
              of_noise.candidates * sizeof(BrickMesh::OpenFace) + lists + others);
}

bool may_meet_region(const MaterialMeshSettings& settings, const Box& closed_box) {
  if (!settings.region) return true;
  const Box reached = closed_box.grown(2);
  return !intersection({parts_per_point * reached.low, parts_per_point * reached.high}, *settings.region)
              .empty();
}

}  // namespace tagrid
