// The part of a mesh with materials that belongs to one brick: its nodes, elements and faces at the ends of
// materials, and which elements hang together.
//
// It depends on the materials around the brick alone. What it shares with its neighbors has keys that are the same in
// both: pipeline/materials puts bricks together by them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "stages/grid/box.h"
#include "stages/materials/interface.h"
#include "stages/materials/material_field.h"
#include "stages/materials/material_lattice.h"

namespace tagrid {

/// Things, numbered from 0 on, of which some are connected.
class ConnectedSets {
 public:
  /// One more, which is connected with no other.
  void add() { parents_.push_back(static_cast<std::uint32_t>(parents_.size())); }
  /// The lowest number in the set of a thing.
  std::uint32_t root(std::uint32_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    parents_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parents_;
};

/// What a mesh is to have.
struct MaterialMeshSettings {
  MaterialLattice lattice;
  std::vector<bool> is_kept;  ///< by material: tetrahedra of others are left out
  /// Only tetrahedra whose bounding boxes meet this one, in parts of the lattice.
  std::optional<Box> region;
  SnapRule rule = closest_vertices;
  int order = 1;  ///< 2: elements have nodes in the middles of their edges, too
  /// A position p, in parts of the lattice, is at origin + p.x * directions[0] + ... in the world.
  std::array<double, 3> origin{};
  std::array<std::array<double, 3>, 3> directions{};
  bool is_mirrored = false;  ///< The determinant of directions is negative.

  bool keeps(Material material) const { return material < is_kept.size() && is_kept[material]; }
  std::array<double, 3> world(Index3 position) const {
    std::array<double, 3> w = origin;
    for (int axis = 0; axis < 3; ++axis)
      for (std::size_t i = 0; i < 3; ++i)
        w[i] += static_cast<double>(position[axis]) * directions[static_cast<std::size_t>(axis)][i];
    return w;
  }
};

struct BrickMesh {
  static constexpr std::uint32_t none = 0xffffffff;
  static constexpr std::int8_t no_side = -1;
  /// A face at the end of the region, where the mesh would go on without it.
  static constexpr std::int8_t side_of_region = 6;

  /// What a node is in the whole mesh: a vertex, or the middle between two of them. The numbers are those of
  /// key_of_vertex().
  struct NodeKey {
    std::uint64_t first = 0, second = 0;
    friend auto operator<=>(const NodeKey&, const NodeKey&) = default;
  };
  struct Node {
    NodeKey key;
    std::array<double, 3> world{};
    std::int64_t z = 0;  ///< of its point in the lattice; of the higher one, if there are two
    /// The part that it belongs to, if all elements around it are of one; otherwise none.
    std::uint32_t part = none;
    /// Other bricks may have it, too.
    bool is_shared = false;
  };
  struct Element {
    /// Four corners in positive order, in the world; with order 2, then the middles of edges 01, 12, 02, 03, 13, 23.
    std::array<std::uint32_t, 10> nodes{};
    Material material = 0;
    std::uint32_t part = 0;
    double volume = 0;                            ///< in the world
    float smallest_angle = 0, largest_angle = 0;  ///< dihedral ones in the world, in degrees
  };
  /// A face of an element, named by the corner that is not on it.
  struct ElementFace {
    std::uint32_t element = none;  ///< none for a tetrahedron of a material that is not kept
    std::uint8_t corner = 0;
    Material material = 0;
  };
  /// A face at the end of a material. At least one side has an element.
  struct Face {
    ElementFace front, back;  ///< The front has the lower material, of those that are kept.
    bool has_back = false;    ///< false at the end of the volume and of the region
    std::int8_t side = no_side;
    double area = 0;
  };
  /// A face whose other side may be in another brick.
  struct OpenFace {
    std::array<std::uint64_t, 3> vertices{};  ///< keys, in rising order
    ElementFace face;
    std::int64_t z = 0;  ///< the highest one of its points in the lattice
    double area = 0;
    bool may_end_region = false;  ///< If there is no other side, it is the end of the region.
  };
  struct Part {
    Material material = 0;
    double volume = 0;
  };

  std::vector<Node> nodes;  ///< in the order in which elements use them
  std::vector<Element> elements;
  std::vector<Face> faces;
  std::vector<OpenFace> open_faces;
  std::vector<Part> parts;  ///< elements that are connected through faces within the brick

  /// The heap that it takes.
  std::uint64_t bytes() const {
    return nodes.capacity() * sizeof(Node) + elements.capacity() * sizeof(Element) +
           faces.capacity() * sizeof(Face) + open_faces.capacity() * sizeof(OpenFace) +
           parts.capacity() * sizeof(Part);
  }
};

/// Which side of a face between two materials is its front: that of the lower material, of those that have an element.
constexpr bool first_is_front(bool first_has_element, Material first, bool second_has_element,
                              Material second) {
  return first_has_element && (!second_has_element || first < second);
}

/// REQUIRES: the field has the samples around the points of lattice.region(closed_box).
BrickMesh mesh_of_brick(const MaterialField& field, const MaterialMeshSettings& settings,
                        const Box& closed_box);

/// The most bytes of a brick of noise, the worst input: of the result, and of the peak while it is made, the result
/// included. Samples are not.
std::uint64_t bytes_of_brick_mesh(const MaterialMeshSettings& settings, const Box& closed_box);
std::uint64_t working_bytes_of_brick_mesh(const MaterialMeshSettings& settings, const Box& closed_box);

/// True if mesh_of_brick() may find something.
bool may_meet_region(const MaterialMeshSettings& settings, const Box& closed_box);

}  // namespace tagrid
