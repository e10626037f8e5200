#include <fmt/format.h>

#include <array>
#include <iterator>
#include <utility>

#include "io/meshes/surface_files.h"

namespace tagrid {
namespace {

/// Vertices and faces alternate, so nothing waits.
class ObjFile final : public SurfaceFile {
 public:
  using SurfaceFile::SurfaceFile;

  void add(const SurfacePiece& piece) override {
    begin();
    for_each_new_vertex(piece, [&](const std::array<double, 3>& p) {
      fmt::format_to(std::back_inserter(text_), "v {} {} {}\n", p[0], p[1], p[2]);
      flush(most_waiting);
    });
    for (const auto& triangle : piece.triangles) {
      // OBJ counts from 1.
      fmt::format_to(std::back_inserter(text_), "f {} {} {}\n", piece.ids[triangle[0]] + 1,
                     piece.ids[triangle[1]] + 1, piece.ids[triangle[2]] + 1);
      flush(most_waiting);
    }
  }

  void finish() override {
    begin();
    flush(0);
  }

 private:
  static constexpr std::size_t most_waiting = std::size_t{1} << 16;

  void begin() {
    if (!std::exchange(has_begun_, true) && !notes_.space.empty())
      text_ = "# " + space_comment(notes_) + "\n";
  }
  void flush(std::size_t most) {
    if (text_.size() <= most) return;
    output_.write(text_);
    text_.clear();
  }

  bool has_begun_ = false;
  std::string text_;
};

}  // namespace

std::unique_ptr<SurfaceFile> create_obj(const std::string& path, bool overwrite) {
  return std::make_unique<ObjFile>(path, overwrite);
}

}  // namespace tagrid
