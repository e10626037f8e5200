// The format: G. Turk, "The PLY Polygon File Format", 1994.
#include <fmt/format.h>

#include <array>
#include <limits>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/meshes/counted_output.h"
#include "io/meshes/surface_files.h"

namespace tagrid {
namespace {

constexpr std::size_t vertex_bytes = 3 * sizeof(double);
constexpr std::size_t face_bytes = 1 + 3 * sizeof(std::int32_t);
constexpr std::size_t head_bytes = 320;

/// A comment of spaces gives the head a fixed size.
std::string head_of(std::int64_t vertices, std::uint64_t faces, const std::string& space) {
  const std::string begin = fmt::format("ply\nformat binary_little_endian 1.0\n{}comment tagrid surface",
                                        space.empty() ? "" : "comment " + space + "\n");
  const std::string end = fmt::format(
      "\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      vertices, faces);
  return begin + std::string(head_bytes - begin.size() - end.size(), ' ') + end;
}

class PlyFile final : public SurfaceFile {
 public:
  PlyFile(const std::string& path, bool overwrite)
      : SurfaceFile(path, overwrite), vertices_(output_, path, head_bytes), faces_(SpoolFile::beside(path)) {}

  void add(const SurfacePiece& piece) override {
    for_each_new_vertex(piece, [&](const std::array<double, 3>& place) {
      std::array<std::byte, vertex_bytes> bytes;
      for (std::size_t axis = 0; axis < 3; ++axis)
        store_little_endian(bytes.data() + axis * sizeof(double), place[axis]);
      vertices_.append(bytes);
    });
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

  void finish() override {
    const std::string head = head_of(vertex_count_, faces_.size() / face_bytes, space_comment(notes_));
    vertices_.finish(std::as_bytes(std::span(head.data(), head.size())));
    faces_.read_back([&](std::span<const std::byte> part) { output_.write(part); });
  }

 private:
  CountedOutput vertices_;
  SpoolFile faces_;
};

}  // namespace

std::unique_ptr<SurfaceFile> create_ply(const std::string& path, bool overwrite) {
  return std::make_unique<PlyFile>(path, overwrite);
}

}  // namespace tagrid
