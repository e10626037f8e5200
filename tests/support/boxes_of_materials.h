// A mesh with materials whose every number is known: cells of a lattice, six tetrahedra each; materials are slabs across
// x.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "io/meshes/material_mesh.h"

namespace tagrid {

struct BoxesOfMaterials {
  std::array<std::int64_t, 3> cells = {2, 1, 1};
  std::array<double, 3> spacing = {1, 1, 1}, origin = {0, 0, 0};
  int order = 1;
  std::int64_t materials = 2;  ///< at most cells[0]; two are "bone" and "soft"
  bool mirrored = false;       ///< x is the other way round
  bool air = false;            ///< above the last slice is another material, which is not in the mesh
  bool empty = false;          ///< with a surface without faces, and a material without elements
};

/// Labels are 10, 20, 30 ...
class MaterialMeshOfBoxes {
 public:
  MaterialMeshOfBoxes(const BoxesOfMaterials& boxes, const std::string& path)
      : boxes_(boxes),
        mesh_{.order = boxes.order,
              .notes = {.space = "LPS"},
              .unit = "mm",
              .materials = {},
              .surfaces = {},
              .points = SpoolFile::beside(path),
              .nodes = SpoolFile::beside(path),
              .face_nodes = SpoolFile::beside(path),
              .faces = SpoolFile::beside(path)} {
    add_points();
    for (std::int64_t i = 0; i < boxes.materials; ++i) add_material(i);
    if (boxes.empty) mesh_.materials.push_back({"nothing", 10 * (boxes.materials + 1), elements_, 0});
    add_surfaces();
  }

  MaterialMesh& mesh() { return mesh_; }

 private:
  using Place = std::array<std::int64_t, 3>;
  struct Face {
    std::vector<std::int64_t> nodes;
    std::array<std::int64_t, 2> sides = {-1, -1};
  };

  std::string name_of(std::int64_t material) const {
    if (boxes_.materials <= 2) return material == 0 ? "bone" : "soft";
    return "m" + std::to_string(material + 1);
  }
  std::int64_t begin_of(std::int64_t material) const { return material * boxes_.cells[0] / boxes_.materials; }

  /// Points are a lattice; of order 2, one with half the distances: all its other points are middles of edges.
  std::int64_t point_at(const Place& halves) const {
    const std::int64_t step = boxes_.order == 1 ? 2 : 1;
    const auto size = [&](std::size_t axis) { return 2 * boxes_.cells[axis] / step + 1; };
    return halves[0] / step + size(0) * (halves[1] / step + size(1) * (halves[2] / step));
  }

  void add_points() {
    const std::int64_t step = boxes_.order == 1 ? 2 : 1;
    Place halves;
    for (halves[2] = 0; halves[2] <= 2 * boxes_.cells[2]; halves[2] += step)
      for (halves[1] = 0; halves[1] <= 2 * boxes_.cells[1]; halves[1] += step)
        for (halves[0] = 0; halves[0] <= 2 * boxes_.cells[0]; halves[0] += step) {
          std::array<double, 3> xyz;
          for (std::size_t axis = 0; axis < 3; ++axis)
            xyz[axis] = boxes_.origin[axis] + boxes_.spacing[axis] * static_cast<double>(halves[axis]) / 2;
          if (boxes_.mirrored) xyz[0] = -xyz[0];
          mesh_.points.write(std::as_bytes(std::span(xyz)));
        }
  }

  std::vector<std::int64_t> nodes_of(const std::vector<Place>& corners) const {
    std::vector<std::int64_t> nodes;
    for (const Place& corner : corners) nodes.push_back(point_at(corner));
    if (boxes_.order == 1) return nodes;
    constexpr std::size_t edges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    for (std::size_t i = 0; i < (corners.size() == 4 ? 6U : 3U); ++i) {
      Place middle;
      for (std::size_t axis = 0; axis < 3; ++axis)
        middle[axis] = (corners[edges[i][0]][axis] + corners[edges[i][1]][axis]) / 2;
      nodes.push_back(point_at(middle));
    }
    return nodes;
  }

  void add_material(std::int64_t material) {
    const std::int64_t first = elements_;
    Place cell;
    for (cell[2] = 0; cell[2] < boxes_.cells[2]; ++cell[2])
      for (cell[1] = 0; cell[1] < boxes_.cells[1]; ++cell[1])
        for (cell[0] = begin_of(material); cell[0] < begin_of(material + 1); ++cell[0])
          for (const auto& axes : {Place{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}})
            add_tetrahedron(material, cell, axes);
    mesh_.materials.push_back({name_of(material), 10 * (material + 1), first, elements_ - first});
  }

  /// From the lowest corner of a cell to the highest one, along one axis after the other.
  void add_tetrahedron(std::int64_t material, const Place& cell, const Place& axes) {
    std::vector<Place> corners = {{2 * cell[0], 2 * cell[1], 2 * cell[2]}};
    for (const std::int64_t axis : axes) {
      corners.push_back(corners.back());
      corners.back()[static_cast<std::size_t>(axis)] += 2;
    }
    const bool is_positive = (axes[1] - axes[0] + 3) % 3 == 1;
    if (is_positive == boxes_.mirrored) std::swap(corners[1], corners[2]);
    // Any of the corners can be the one that is not on a surface.
    const std::size_t turn = static_cast<std::size_t>(elements_ % 4);
    corners = {corners[turn], corners[turn ^ 1], corners[turn ^ 2], corners[turn ^ 3]};
    const std::vector<std::int64_t> nodes = nodes_of(corners);
    mesh_.nodes.write(std::as_bytes(std::span(nodes)));
    constexpr std::size_t faces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    for (std::size_t c = 0; c < 4; ++c)
      add_face(material, {corners[faces[c][0]], corners[faces[c][1]], corners[faces[c][2]]},
               4 * elements_ + static_cast<std::int64_t>(c));
    ++elements_;
  }

  void add_face(std::int64_t material, const std::vector<Place>& corners, std::int64_t side) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t place = corners[0][axis];
      if (corners[1][axis] != place || corners[2][axis] != place) continue;
      if (place == 0 || place == 2 * boxes_.cells[axis]) {
        sides_[{material, 2 * static_cast<int>(axis) + (place != 0)}].push_back(
            {nodes_of(corners), {side, -1}});
      } else if (axis == 0) {
        std::vector<std::int64_t> key = nodes_of(corners);
        std::sort(key.begin(), key.end());
        if (place == 2 * begin_of(material + 1)) {
          waiting_[key] = interfaces_[material].size();
          interfaces_[material].push_back({nodes_of(corners), {side, -1}});
        } else if (place == 2 * begin_of(material)) {
          // Materials come in order, so the front of this face is known.
          interfaces_[material - 1][waiting_.at(key)].sides[1] = side;
        }
      }
    }
  }

  void add_surfaces() {
    for (const auto& [front, faces] : interfaces_)
      add_surface({name_of(front) + "_" + name_of(front + 1),
                   static_cast<std::size_t>(front),
                   static_cast<std::size_t>(front + 1),
                   {},
                   0,
                   0},
                  faces);
    if (boxes_.empty) add_surface({"bone_nothing", 0, mesh_.materials.size() - 1, {}, 0, 0}, {});
    for (const auto& [where, faces] : sides_) {
      const auto& [material, side] = where;
      const bool is_air = boxes_.air && side == 5;
      const std::string what = is_air ? "air" : std::string(names_of_sides[static_cast<std::size_t>(side)]);
      add_surface({name_of(material) + "_" + what,
                   static_cast<std::size_t>(material),
                   {},
                   is_air ? std::optional<int>() : side,
                   0,
                   0},
                  faces);
    }
  }

  void add_surface(MaterialSurface surface, const std::vector<Face>& faces) {
    surface.first = faces_;
    surface.count = static_cast<std::int64_t>(faces.size());
    faces_ += surface.count;
    for (const Face& face : faces) {
      mesh_.face_nodes.write(std::as_bytes(std::span(face.nodes)));
      mesh_.faces.write(std::as_bytes(std::span(face.sides)));
    }
    mesh_.surfaces.push_back(std::move(surface));
  }

  BoxesOfMaterials boxes_;
  MaterialMesh mesh_;
  std::int64_t elements_ = 0, faces_ = 0;
  std::map<std::int64_t, std::vector<Face>> interfaces_;  ///< by the material in front
  std::map<std::pair<std::int64_t, int>, std::vector<Face>> sides_;
  std::map<std::vector<std::int64_t>, std::size_t> waiting_;
};

}  // namespace tagrid
