// The format: 80 bytes of text, the number of triangles (uint32), and for each its normal, its three corners
// (floats), and a uint16 that is 0. The text must not begin with "solid", the sign of STL in ASCII.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <string>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/meshes/counted_output.h"
#include "io/meshes/surface_files.h"

namespace tagrid {
namespace {

using Point = std::array<float, 3>;

constexpr std::size_t stl_head = 84, triangle_bytes = 12 * sizeof(float) + 2;

/// With an error above this fraction of a voxel, small triangles lose their shape.
constexpr double visible = 0.01;

Point as_floats(const std::array<double, 3>& p) {
  return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

Point normal_of(const std::array<Point, 3>& corners) {
  double p[3], q[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    p[axis] = static_cast<double>(corners[1][axis]) - static_cast<double>(corners[0][axis]);
    q[axis] = static_cast<double>(corners[2][axis]) - static_cast<double>(corners[0][axis]);
  }
  const double n[] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
  const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  if (!(length > 0)) return {};
  return as_floats({n[0] / length, n[1] / length, n[2] / length});
}

class StlFile final : public SurfaceFile {
 public:
  StlFile(const std::string& path, bool overwrite)
      : SurfaceFile(path, overwrite), triangles_(output_, path, stl_head) {}

  void add(const SurfacePiece& piece) override {
    for (const auto& triangle : piece.triangles) {
      std::array<Point, 3> corners;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::array<double, 3> place = piece.position(triangle[i]);
        corners[i] = as_floats(place);
        for (std::size_t axis = 0; axis < 3; ++axis)
          rounding_ = std::max(rounding_, std::abs(place[axis] - static_cast<double>(corners[i][axis])));
      }
      std::array<std::byte, triangle_bytes> bytes{};
      std::byte* to = bytes.data();
      const auto put = [&](const Point& p) {
        for (const float x : p) {
          store_little_endian(to, x);
          to += sizeof x;
        }
      };
      put(normal_of(corners));
      for (const Point& corner : corners) put(corner);
      triangles_.append(bytes);
      ++count_;
    }
  }

  void finish() override {
    if (count_ > std::numeric_limits<std::uint32_t>::max())
      throw WorldError(output_.name() + ": the surface has more triangles than STL can count; write .vtp");
    std::array<std::byte, stl_head> head{};
    std::string text = "tagrid isosurface, binary STL";
    if (!notes_.space.empty()) text += "; " + space_comment(notes_);
    assert(text.size() < 80);
    for (std::size_t i = 0; i < text.size(); ++i) head[i] = static_cast<std::byte>(text[i]);
    store_little_endian(head.data() + 80, static_cast<std::uint32_t>(count_));
    triangles_.finish(head);
  }

  std::vector<std::string> warnings() const override {
    if (!(rounding_ > visible * notes_.spacing)) return {};
    return {fmt::format(
        "{}: STL has 32-bit numbers: this far from the origin, they move vertices by up to {:.2g} "
        "where samples are {:.6g} apart, and triangles lose their shape or area; .ply, .vtp and "
        ".obj files have 64-bit numbers",
        output_.name(), rounding_, notes_.spacing)};
  }

 private:
  CountedOutput triangles_;
  std::uint64_t count_ = 0;
  double rounding_ = 0;  ///< the largest difference between a coordinate and its float
};

}  // namespace

std::unique_ptr<SurfaceFile> create_stl(const std::string& path, bool overwrite) {
  return std::make_unique<StlFile>(path, overwrite);
}

}  // namespace tagrid
