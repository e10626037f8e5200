#include "io/meshes/obj.h"

#include <fmt/format.h>

#include <iterator>
#include <utility>

namespace tagrid {
namespace {

constexpr std::size_t buffer = std::size_t{1} << 16;

}  // namespace

void ObjFile::add(const SurfacePiece& piece) {
  begin();
  for (std::size_t i = 0; i < piece.ids.size(); ++i) {
    if (piece.ids[i] < vertex_count_) continue;
    const std::array<double, 3> p = piece.position(i);
    fmt::format_to(std::back_inserter(text_), "v {} {} {}\n", p[0], p[1], p[2]);
    ++vertex_count_;
    flush(buffer);
  }
  for (const auto& triangle : piece.triangles) {
    // OBJ counts from 1.
    fmt::format_to(std::back_inserter(text_), "f {} {} {}\n", piece.ids[triangle[0]] + 1,
                   piece.ids[triangle[1]] + 1, piece.ids[triangle[2]] + 1);
    flush(buffer);
  }
}

void ObjFile::begin() {
  if (!std::exchange(has_begun_, true) && !notes_.space.empty()) text_ = "# " + space_comment(notes_) + "\n";
}

void ObjFile::finish() {
  begin();
  flush(0);
}

void ObjFile::flush(std::size_t most) {
  if (text_.size() <= most) return;
  output_.write(text_);
  text_.clear();
}

}  // namespace tagrid
