#include "io/meshes/mesh_files.h"

#include <algorithm>
#include <cassert>

#include "io/bytes/little_endian.h"

namespace tagrid {
namespace {

void spool_numbers(SpoolFile& array, std::span<const std::byte> bytes, std::size_t number_size) {
  std::vector<std::byte> swapped;
  array.write(little_endian_samples(bytes, number_size, swapped));
}

}  // namespace

void MeshFile::add_points(std::span<const double> xyz, std::span<const std::byte> values) {
  assert(xyz.size() % 3 == 0 && values.size() == xyz.size() / 3 * size_of(mesh_.value_type));
  spool_numbers(mesh_.coordinates, std::as_bytes(xyz), sizeof(double));
  spool_numbers(mesh_.values, values, size_of(mesh_.value_type));
  mesh_.points += static_cast<std::int64_t>(xyz.size() / 3);
}

void MeshFile::add_tetrahedra(std::span<const std::int64_t> connectivity,
                              std::span<const std::uint8_t> levels) {
  assert(connectivity.size() == 4 * levels.size());
  for (const std::int64_t index : connectivity) {
    assert(index >= 0);
    largest_index_ = std::max(largest_index_, index);
  }
  spool_numbers(mesh_.connectivity, std::as_bytes(connectivity), sizeof(std::int64_t));
  mesh_.levels.write(std::as_bytes(levels));
  mesh_.tetrahedra += static_cast<std::int64_t>(levels.size());
}

void MeshFile::finish() {
  assert(largest_index_ < mesh_.points);
  write_mesh();
}

}  // namespace tagrid
