// The faces of a mesh with materials that solvers put loads and conditions on, and what formats can hold.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/meshes/material_files.h"
#include "io/meshes/material_mesh.h"
#include "io/meshes/mesh_contents.h"

namespace tagrid {

/// Faces with a name: those of surfaces, from their front or from their back.
struct FacetSet {
  struct Part {
    std::size_t surface = 0;
    bool is_back = false;
  };
  std::string name;
  std::vector<Part> parts;
  bool is_turned = false;  ///< Another set has the same faces, from the front.
};

/// Each surface (bone_soft); an interface from its back (soft_bone); all faces of a material (bone_surface); and each
/// side of the box, of all materials (x_min). None is empty, and no two names differ only in case: a name that is taken
/// gets _2, _3 and so on.
std::vector<FacetSet> facet_sets(const MaterialMesh& mesh);

/// Throws UsageError if the file cannot hold the mesh.
void check_limits(const FormatLimits& limits, const MaterialMesh& mesh, const std::string& file);
/// Throws UsageError if the file cannot have the name.
void check_name(const FormatLimits& limits, const std::string& name, const std::string& file);

/// What a file says in a comment: "Tetrahedra with materials; SPACE=LPS; unit=mm", as far as it is known. It has no
/// line ends, and nothing that ends a comment.
std::string remark_of(const MaterialMesh& mesh);

/// Calls use(number, numbers) for `count` entries of a spooled array of int64, from entry `first` on: `number` is that
/// of the entry, and `numbers` are its own, `size` of them, plus `plus`.
template <class Use>
void for_each_entry(SpoolFile& array, std::size_t size, std::int64_t first, std::int64_t count,
                    std::int64_t plus, Use use) {
  constexpr std::size_t bytes = sizeof(std::int64_t);
  std::array<std::int64_t, 10> numbers;
  const auto pass = [&](std::int64_t number, std::span<const std::byte> piece) {
    for (const std::byte* at = piece.data(); at != piece.data() + piece.size(); at += size * bytes) {
      for (std::size_t i = 0; i < size; ++i)
        numbers[i] = load_little_endian<std::int64_t>(at + i * bytes) + plus;
      use(number++, std::span<const std::int64_t>(numbers.data(), size));
    }
  };
  for_each_piece(array, size * bytes, first, count, pass);
}

/// Calls use(point, xyz) for all points.
template <class Use>
void for_each_point_of(SpoolFile& points, Use use) {
  for_each_piece(points, 3 * sizeof(double), [&](std::int64_t point, std::span<const std::byte> piece) {
    std::array<double, 3> xyz;
    for (std::size_t at = 0; at < piece.size(); at += sizeof xyz) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        xyz[axis] = load_little_endian<double>(piece.data() + at + axis * sizeof(double));
      use(point++, std::span<const double, 3>(xyz));
    }
  });
}

inline constexpr std::int64_t most_sorted_nodes = std::int64_t{1} << 20;

/// Calls use(point) for each point of the faces, once, in increasing order. Memory: 8 MiB for any mesh.
/// `most_sorted`: above so many nodes, points are marked instead of sorted.
template <class Use>
void for_each_point_on(MaterialMesh& mesh, const FacetSet& set, Use use,
                       std::int64_t most_sorted = most_sorted_nodes) {
  constexpr std::int64_t window = std::int64_t{1} << 26;  // points marked at a time: 8 MiB
  const auto for_each_node = [&](auto visit) {
    for (const FacetSet::Part& part : set.parts) {
      const MaterialSurface& surface = mesh.surfaces[part.surface];
      for_each_entry(mesh.face_nodes, mesh.nodes_of_face(), surface.first, surface.count, 0,
                     [&](std::int64_t, std::span<const std::int64_t> nodes) {
                       for (const std::int64_t node : nodes) visit(node);
                     });
    }
  };
  std::int64_t count = 0;
  for (const FacetSet::Part& part : set.parts) count += mesh.surfaces[part.surface].count;
  // A mesh may have a hundred thousand small sets: marks for all its points would be too slow.
  if (count * static_cast<std::int64_t>(mesh.nodes_of_face()) <= most_sorted) {
    std::vector<std::int64_t> points;
    for_each_node([&](std::int64_t node) { points.push_back(node); });
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    for (const std::int64_t point : points) use(point);
    return;
  }
  std::vector<std::uint64_t> marks;
  for (std::int64_t begin = 0; begin < mesh.point_count(); begin += window) {
    const std::int64_t size = std::min(window, mesh.point_count() - begin);
    marks.assign(static_cast<std::size_t>(size / 64 + 1), 0);
    for_each_node([&](std::int64_t node) {
      if (const std::int64_t i = node - begin; i >= 0 && i < size)
        marks[static_cast<std::size_t>(i / 64)] |= std::uint64_t{1} << (i % 64);
    });
    for (std::size_t i = 0; i < marks.size(); ++i)
      for (std::uint64_t bits = marks[i]; bits != 0; bits &= bits - 1)
        use(begin + static_cast<std::int64_t>(64 * i) + std::countr_zero(bits));
  }
}

}  // namespace tagrid
