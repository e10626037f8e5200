// The laws of a conforming tetrahedral mesh, checked on the whole mesh from nothing but the mesh.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "stages/grid/lattice.h"
#include "tests/support/vtu_reader.h"

namespace tagrid {

/// A mesh whose points are lattice points.
struct LatticeMesh {
  std::vector<Index3> points;
  std::vector<std::int64_t> connectivity;  ///< four per tetrahedron
  std::vector<std::uint8_t> levels, types;

  std::size_t size() const { return levels.size(); }
  std::array<std::int64_t, 4> ids(std::size_t t) const {
    return {connectivity[4 * t], connectivity[4 * t + 1], connectivity[4 * t + 2], connectivity[4 * t + 3]};
  }
  std::array<Index3, 4> vertices(std::size_t t) const {
    std::array<Index3, 4> v;
    for (std::size_t i = 0; i < 4; ++i) v[i] = points[static_cast<std::size_t>(connectivity[4 * t + i])];
    return v;
  }
};

/// Reads a mesh of a volume with spacing 1 and origin 0, whose first sample is the lattice point `first`; throws
/// if it is not one.
inline LatticeMesh read_lattice_mesh(Vtu& vtu, Index3 first = {0, 0, 0}) {
  LatticeMesh mesh;
  const std::vector<double> xyz = vtu.array<double>("Float64", "Points");
  mesh.points.reserve(xyz.size() / 3);
  for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) {
    Index3 p;
    for (int axis = 0; axis < 3; ++axis) {
      const double x = xyz[i + static_cast<std::size_t>(axis)] + static_cast<double>(first[axis]);
      if (!(x >= 0 && x < 1e9 && x == std::floor(x))) throw std::runtime_error("not a lattice point");
      p[axis] = static_cast<std::int64_t>(x);
    }
    mesh.points.push_back(p);
  }
  mesh.connectivity = vtu.array<std::int64_t>("Int64", "connectivity");
  mesh.levels = vtu.array<std::uint8_t>("UInt8", "level");
  mesh.types = vtu.array<std::uint8_t>("UInt8", "type");
  const auto n = static_cast<std::int64_t>(mesh.points.size());
  for (std::int64_t id : mesh.connectivity)
    if (id < 0 || id >= n) throw std::runtime_error("a tetrahedron has a point that does not exist");
  if (mesh.connectivity.size() != 4 * mesh.levels.size() || mesh.types.size() != mesh.levels.size())
    throw std::runtime_error("the arrays do not fit");
  return mesh;
}

/// Findings. In a good mesh, all but the first two must be zero.
struct MeshFindings {
  std::int64_t six_volumes = 0;  ///< sum
  std::int64_t open_faces = 0;   ///< in one tetrahedron only
  std::int64_t not_positive = 0;
  std::int64_t wrong_level_or_type = 0;  ///< volumes do not match the levels, or type is not level % 3
  std::int64_t crowded_faces = 0;        ///< in three or more tetrahedra
  std::int64_t twice = 0;                ///< points at the position of another one
  std::int64_t unused = 0;               ///< points of no tetrahedron
  std::int64_t hanging = 0;              ///< edges with a point of the mesh between their ends

  bool good() const {
    return not_positive + wrong_level_or_type + crowded_faces + twice + unused + hanging == 0;
  }
  std::string text() const {
    std::string all;
    const auto say = [&](std::int64_t n, const char* what) {
      if (n > 0) all += std::to_string(n) + " " + what + "; ";
    };
    say(not_positive, "tetrahedra are not positive");
    say(wrong_level_or_type, "tetrahedra have a wrong level or type");
    say(crowded_faces, "faces are in more than two tetrahedra");
    say(twice, "points are there twice");
    say(unused, "points are not used");
    say(hanging, "edges have a point between their ends");
    return all;
  }
};

/// True if a tetrahedron has a vertex in the border of the box.
inline bool ends_at(const std::array<Index3, 4>& vertices, const Box& box) {
  for (Index3 v : vertices)
    for (int axis = 0; axis < 3; ++axis)
      if (v[axis] == box.low[axis] || v[axis] == box.high[axis]) return true;
  return false;
}

/// `cut_at`: the box to which the mesh was cut, if it was; pieces at its border are smaller than their level
/// implies.
inline void check_tetrahedra(const LatticeMesh& mesh, MeshFindings& found, const std::optional<Box>& cut_at) {
  std::int64_t root = 0;  // six volumes of a tetrahedron of level 0
  for (std::size_t t = 0; t < mesh.size(); ++t)
    root = std::max(root, six_volumes(mesh.vertices(t)) << mesh.levels[t]);
  std::vector<bool> used(mesh.points.size());
  for (std::size_t t = 0; t < mesh.size(); ++t) {
    const std::int64_t six = six_volumes(mesh.vertices(t));
    found.six_volumes += six;
    found.not_positive += six <= 0;
    const bool whole = six << mesh.levels[t] == root;
    found.wrong_level_or_type +=
        (!whole && !(cut_at && ends_at(mesh.vertices(t), *cut_at))) || mesh.types[t] != mesh.levels[t] % 3;
    for (std::int64_t id : mesh.ids(t)) used[static_cast<std::size_t>(id)] = true;
  }
  found.unused = std::count(used.begin(), used.end(), false);
}

/// Counts the edges that have a point of the mesh on one of their inner lattice points. Every lattice point
/// has a bit.
inline void check_points(const LatticeMesh& mesh, MeshFindings& found) {
  Index3 size{1, 1, 1};
  for (Index3 p : mesh.points)
    for (int axis = 0; axis < 3; ++axis) size[axis] = std::max(size[axis], p[axis] + 1);
  const auto at = [&](Index3 p) { return static_cast<std::size_t>((p.z * size.y + p.y) * size.x + p.x); };
  std::vector<bool> taken(static_cast<std::size_t>(size.x * size.y * size.z));
  for (Index3 p : mesh.points) {
    found.twice += taken[at(p)];
    taken[at(p)] = true;
  }
  for (std::size_t t = 0; t < mesh.size(); ++t) {
    const auto v = mesh.vertices(t);
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const Index3 d = v[i] - v[j];
        const std::int64_t steps = std::gcd(std::gcd(d.x, d.y), d.z);
        for (std::int64_t k = 1; k < steps; ++k)
          if (taken[at(v[j] + k * Index3{d.x / steps, d.y / steps, d.z / steps})]) {
            ++found.hanging;
            break;
          }
      }
  }
}

/// Sorts the faces by their smallest point, and calls open_face(ids) for those in only one tetrahedron. Takes
/// 32 bytes per tetrahedron and 8 per point.
template <class OpenFace>
void check_faces(const LatticeMesh& mesh, MeshFindings& found, OpenFace open_face) {
  if (mesh.points.size() >> 32 != 0) throw std::runtime_error("too many points to check");
  const auto for_each_face = [&](auto visit) {
    for (std::size_t t = 0; t < mesh.size(); ++t) {
      auto v = mesh.ids(t);
      std::sort(v.begin(), v.end());
      for (std::size_t left_out = 0; left_out < 4; ++left_out) {
        const auto first = static_cast<std::size_t>(v[left_out == 0 ? 1 : 0]);
        const auto second = static_cast<std::uint64_t>(v[left_out <= 1 ? 2 : 1]);
        const auto third = static_cast<std::uint64_t>(v[left_out <= 2 ? 3 : 2]);
        visit(first, second << 32 | third);
      }
    }
  };
  std::vector<std::size_t> end(mesh.points.size() + 1);  // of the faces of each first point
  for_each_face([&](std::size_t first, std::uint64_t) { ++end[first + 1]; });
  std::partial_sum(end.begin(), end.end(), end.begin());
  std::vector<std::uint64_t> faces(end.back());
  for_each_face([&](std::size_t first, std::uint64_t others) { faces[end[first]++] = others; });
  std::size_t begin = 0;
  for (std::size_t first = 0; first < mesh.points.size(); begin = end[first++]) {
    const std::span<std::uint64_t> same = std::span(faces).subspan(begin, end[first] - begin);
    std::sort(same.begin(), same.end());
    for (std::size_t i = 0; i < same.size();) {
      std::size_t next = i;
      while (next < same.size() && same[next] == same[i]) ++next;
      found.crowded_faces += next - i > 2;
      if (next - i == 1) {
        ++found.open_faces;
        open_face(std::array<std::size_t, 3>{first, same[i] >> 32, same[i] & 0xffffffff});
      }
      i = next;
    }
  }
}

/// `cut_at`: see check_tetrahedra().
template <class OpenFace>
MeshFindings check_mesh(const LatticeMesh& mesh, OpenFace open_face, const std::optional<Box>& cut_at = {}) {
  MeshFindings found;
  check_tetrahedra(mesh, found, cut_at);
  check_points(mesh, found);
  check_faces(mesh, found, open_face);
  return found;
}

/// True if all three points lie in one of the planes that bound the box.
inline bool is_on_border(const std::array<Index3, 3>& face, const Box& box) {
  for (int axis = 0; axis < 3; ++axis)
    for (std::int64_t plane : {box.low[axis], box.high[axis]})
      if (face[0][axis] == plane && face[1][axis] == plane && face[2][axis] == plane) return true;
  return false;
}

}  // namespace tagrid
