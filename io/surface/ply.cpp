// The format: G. Turk, "The PLY Polygon File Format", 1994.
#include "io/surface/ply.h"

#include <fmt/format.h>

#include <array>
#include <limits>

#include "io/bytes/little_endian.h"
#include "io/files/errors.h"

namespace tagrid {
namespace {

constexpr std::size_t vertex_bytes = 3 * sizeof(double);
constexpr std::size_t face_bytes = 1 + 3 * sizeof(std::int32_t);

}  // namespace

PlyFile::PlyFile(const std::string& path, bool overwrite)
    : SurfaceFile(path, overwrite), vertices_(SpoolFile::beside(path)), faces_(SpoolFile::beside(path)) {}

void PlyFile::add(const SurfacePiece& piece) {
  for (std::size_t i = 0; i < piece.ids.size(); ++i) {
    if (piece.ids[i] < vertex_count_) continue;
    std::array<std::byte, vertex_bytes> bytes;
    const std::array<double, 3> place = piece.position(i);
    for (std::size_t axis = 0; axis < 3; ++axis)
      store_little_endian(bytes.data() + axis * sizeof(double), place[axis]);
    vertices_.write(bytes);
    ++vertex_count_;
  }
  if (vertex_count_ > std::numeric_limits<std::int32_t>::max())
    throw WorldError(output_.name() + ": the surface has more vertices than PLY can number; write .vtp");
  for (const auto& triangle : piece.triangles) {
    std::array<std::byte, face_bytes> bytes;
    bytes[0] = std::byte{3};
    for (std::size_t i = 0; i < 3; ++i)
      store_little_endian(bytes.data() + 1 + i * sizeof(std::int32_t),
                          static_cast<std::int32_t>(piece.ids[triangle[i]]));
    faces_.write(bytes);
  }
}

void PlyFile::finish() {
  output_.write(
      fmt::format("ply\nformat binary_little_endian 1.0\n"
                  "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
                  "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                  vertex_count_, faces_.size() / face_bytes));
  const auto copy = [&](std::span<const std::byte> part) { output_.write(part); };
  vertices_.read_back(copy);
  faces_.read_back(copy);
}

}  // namespace tagrid
