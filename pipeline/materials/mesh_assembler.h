// Puts the bricks of a mesh with materials together: numbers nodes and elements, joins faces and parts across bricks,
// and leaves out parts that are not wanted.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "io/files/spool_file.h"
#include "io/meshes/material_mesh.h"
#include "pipeline/materials/kept_numbers.h"
#include "stages/materials/brick_mesh.h"

namespace tagrid {

/// Which of the connected parts of each material are kept.
struct PartsWish {
  bool only_largest = false;
  double least_volume = 0;  ///< in the world; smaller parts are left out

  bool is_all() const { return !only_largest && least_volume <= 0; }
};

/// The names of materials; others are called after their labels.
struct MaterialNames {
  std::map<Material, std::string> names;
  /// The label of material 0. Materials of values are labelled by their place, from 1 on.
  std::int64_t first_label = 0;

  std::string name_of(Material material) const {
    const auto found = names.find(material);
    return found == names.end() ? "label_" + std::to_string(material) : found->second;
  }
};

/// The elements of a mesh, measured. Lengths are those of the world.
struct MeshQuality {
  struct OfMaterial {
    std::string name;
    std::int64_t tetrahedra = 0;
    double volume = 0, area = 0;
    std::int64_t parts = 0;           ///< connected through faces
    std::int64_t touching_edges = 0;  ///< edges of its surface that have more than two faces of it
    std::int64_t removed_parts = 0, removed_tetrahedra = 0;
  };
  static constexpr double degrees_of_bin = 5;
  using Histogram = std::array<std::int64_t, 36>;

  std::vector<OfMaterial> materials;
  /// How many tetrahedra have their smallest, and their largest, dihedral angle in these 5 degrees.
  Histogram smallest{}, largest{};
  double smallest_angle = 180, largest_angle = 0;
};

/// Where nameless temporary files are: in a folder, for what a message calls `whose`.
struct SpoolPlace {
  std::string folder, whose;

  SpoolFile file() const { return SpoolFile::in(folder, whose); }
};

/// A limit on the memory of a process, and what others than parts and surfaces need of it while bricks are made and
/// afterwards. How many parts a mesh has is known only when it is made.
struct PartsMemory {
  std::uint64_t limit = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t others = 0, others_at_end = 0;
};

class MeshAssembler {
 public:
  /// What does not fit into memory waits in temporary files. `settings` must stay.
  MeshAssembler(const MaterialMeshSettings& settings, const SpoolPlace& place,
                const PartsMemory& memory = {});

  /// REQUIRES: bricks come in the order of their numbers. Throws MemoryLimit if there are too many parts.
  void add(const BrickMesh& brick);
  /// Forgets what is shared below a plane of the lattice, because no further brick has it.
  void end_layer(std::int64_t z);
  /// Fills in materials, surfaces and all files of the mesh. To be called once, at the end. Throws WorldError, and
  /// MemoryLimit if there are too many parts or surfaces.
  MeshQuality finish(const MaterialNames& names, const PartsWish& wish, MaterialMesh& mesh);

 private:
  static constexpr std::size_t most_nodes = 10, most_nodes_of_face = 6;

  /// An element in the file of elements.
  struct Element {
    std::array<std::int64_t, most_nodes> nodes{};
    double volume = 0;
    float smallest_angle = 0, largest_angle = 0;
    std::uint32_t part = 0;
    Material material = 0;
  };
  /// A side of a face.
  struct Side {
    std::int64_t place = -1;  ///< of the element among those of its material; -1: it has none
    std::uint32_t part = 0;
    Material material = 0;
    std::uint8_t corner = 0;
  };
  /// A face in the file of faces. Its nodes are as seen from outside of `front`, or of `back` if `is_of_back`.
  struct Face {
    std::array<std::int64_t, most_nodes_of_face> nodes{};
    double area = 0;
    Side front, back;
    std::int8_t side = BrickMesh::no_side;
    bool has_back = false;
  };
  struct OpenFace {
    std::array<std::int64_t, most_nodes_of_face> nodes{};
    double area = 0;
    std::int64_t z = 0;
    Side side;
    bool may_end_region = false;
  };
  struct SharedNode {
    std::int64_t number = 0, z = 0;
    std::uint32_t part = BrickMesh::none;
  };
  struct HashOfKey {
    std::size_t operator()(const BrickMesh::NodeKey& key) const;
    std::size_t operator()(const std::array<std::uint64_t, 3>& key) const;
  };
  /// Which surface a face is in.
  struct SurfaceKey {
    Material front = 0;
    int kind = 0;
    Material back = 0;
    friend auto operator<=>(const SurfaceKey&, const SurfaceKey&) = default;
  };
  class Kept;

  Side side_of(const BrickMesh& brick, const BrickMesh::ElementFace& face) const;
  std::array<std::int64_t, most_nodes_of_face> nodes_of(const BrickMesh& brick,
                                                        const BrickMesh::ElementFace& face) const;
  void number_nodes(const BrickMesh& brick);
  void add_elements(const BrickMesh& brick);
  void add_faces(const BrickMesh& brick);
  void add_open_face(const BrickMesh& brick, const BrickMesh::OpenFace& open);
  void end_region(const OpenFace& open);

  std::uint64_t bytes_of_parts() const;
  void require_memory(std::uint64_t bytes, std::uint64_t of_others, const std::string& what) const;
  void write_points(const Kept& kept, MaterialMesh& mesh);
  void write_elements(const Kept& kept, MaterialMesh& mesh, MeshQuality& quality);
  void write_faces(const Kept& kept, const MaterialNames& names, MaterialMesh& mesh, MeshQuality& quality);

  const MaterialMeshSettings& settings_;
  PartsMemory memory_;
  std::int64_t node_count_ = 0;
  std::map<Material, std::int64_t> element_counts_;
  SpoolFile points_, elements_, faces_;
  std::unordered_map<BrickMesh::NodeKey, SharedNode, HashOfKey> shared_;
  std::unordered_map<std::array<std::uint64_t, 3>, OpenFace, HashOfKey> open_;
  ConnectedSets connected_;  ///< parts
  std::vector<BrickMesh::Part> parts_;
  // Of the brick that is added:
  std::vector<std::int64_t> numbers_;  ///< of nodes in the mesh
  std::vector<std::int64_t> places_;   ///< of elements among those of their material
  std::uint32_t first_part_ = 0;
};

/// Counts the edges where a material touches itself; see MeshQuality. Memory: most_bytes.
void count_touching_edges(MaterialMesh& mesh, MeshQuality& quality, std::size_t most_bytes);

}  // namespace tagrid
