// tagrid-read-png: reads folders of PNG slices with libpng.

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/formats/png/outline.h"
#include "io/formats/png/reader/image.h"
#include "io/formats/slices/slice_files.h"
#include "io/programs/serve_reader.h"
#include "io/text/paths.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

class PngSlices final : public ServedVolume {
 public:
  explicit PngSlices(std::vector<std::string> paths) {
    files = std::move(paths);
    std::vector<BytesAfter> after;
    ResolutionOfSlices resolution;
    for (const std::string& path : files) {
      say_working();
      const PngOutline outline = png_outline(FileSource(path));
      if (path == files.front()) first_ = outline;
      require_like_first(path, outline);
      transparent_ += outline.has_transparent ? 1 : 0;
      animated_ += outline.has_more_images ? 1 : 0;
      if (outline.after > 0) after.push_back({path, outline.after});
      resolution.add(outline.x_per_meter, outline.y_per_meter);
    }
    say_what_is_not_read();
    add_bytes_after(after, warnings);
    constexpr double meter = 1000;  // millimeters
    resolution.describe(files.front(), meter, geometry, warnings);
    dims = {first_.width, first_.height, static_cast<std::int64_t>(files.size())};
    type = first_.bits == 8 ? SampleType::uint8 : SampleType::uint16;
    if (!is_volume_size(dims) || !sample_bytes(dims, type))
      throw BrokenInput("{}: a volume cannot have {} samples", files.front(), described(dims, type));
    // The decoder has a few rows, the pointers to all of them, and the windows of deflate.
    constexpr std::uint64_t of_decoder = std::uint64_t{4} << 20;
    memory = 2 * bytes_of_slice() + 8 * static_cast<std::uint64_t>(first_.height) + of_decoder;
  }

  void read_slice(std::int64_t z, std::byte* out) override {
    const std::string& path = files[static_cast<std::size_t>(z)];
    require_like_first(path, png_outline(FileSource(path)));
    read_png(path, first_, {out, bytes_of_slice()});
    // The file has the most significant byte first.
    for (std::size_t i = 0; first_.bits == 16 && i < bytes_of_slice(); i += 2) std::swap(out[i], out[i + 1]);
  }

 private:
  std::size_t bytes_of_slice() const {
    return static_cast<std::size_t>(first_.width * first_.height) * static_cast<std::size_t>(first_.bits / 8);
  }

  void require_like_first(const std::string& path, const PngOutline& outline) const {
    if (outline.width != first_.width || outline.height != first_.height || outline.bits != first_.bits)
      throw BrokenInput("{}: PNG file: has {}, but {} has {}", path, in_words(outline), files.front(),
                        in_words(first_));
  }

  static std::string in_words(const PngOutline& outline) {
    return fmt::format("{} x {} samples of {} bits", outline.width, outline.height, outline.bits);
  }

  /// Says it once of all slices, without the name of any.
  void say_what_is_not_read() {
    const std::filesystem::path first(path_of(files.front()));
    const std::string where = files.size() == 1 ? text_of(first) : text_of(first.parent_path());
    if (transparent_ > 0)
      not_understood.push_back(fmt::format(
          "{}: {} of {} files say that samples of one value are transparent; they are read as others are",
          where, transparent_, files.size()));
    if (animated_ > 0)
      not_understood.push_back(
          fmt::format("{}: {} of {} files are animations, of which only the first image is read", where,
                      animated_, files.size()));
  }

  PngOutline first_;
  std::size_t transparent_ = 0, animated_ = 0;  ///< files
};

}  // namespace
}  // namespace tagrid

int main() {
  return tagrid::serve_volumes("png", [](const std::string& path, const tagrid::ReaderOptions& options) {
    return tagrid::open_slices<tagrid::PngSlices>(path, {".png"}, options);
  });
}
