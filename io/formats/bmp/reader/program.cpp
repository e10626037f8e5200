// tagrid-read-bmp: reads folders of BMP slices, which SkyScan's programs write.

#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "io/formats/bmp/image.h"
#include "io/formats/slices/slice_files.h"

namespace tagrid {
namespace {

class BmpSlices final : public ServedVolume {
 public:
  explicit BmpSlices(std::vector<std::string> paths) : slices_(paths.size()) {
    files = std::move(paths);
    bool is_plain = true;
    std::vector<BytesAfter> after;
    for (std::size_t z = 0; z < slices_; ++z) {
      say_working();
      const BmpImage image = bmp_image(FileSource(files[z]));
      if (z == 0) first_ = image;
      require_like_first(z, image);
      if (image.after > 0) after.push_back({files[z], image.after});
      // Samples of a shorter palette are checked as they are read.
      is_plain = is_plain && image.grays == 256;
      SliceRun run{z, image.offset, 1, image.row_bytes() * static_cast<std::uint64_t>(image.height)};
      run.row_step = image.row_bytes();
      run.bottom_up = !image.is_top_down;
      places.push_back(run);
    }
    if (!is_plain) places.clear();
    add_bytes_after(after, warnings);
    dims = {first_.width, first_.height, static_cast<std::int64_t>(slices_)};
    type = SampleType::uint8;
    memory = 2 * first_.row_bytes() * static_cast<std::uint64_t>(first_.height);
  }

  void read_slice(std::int64_t z, std::byte* out) override {
    const FileSource file(files[static_cast<std::size_t>(z)]);
    const BmpImage image = bmp_image(file);
    require_like_first(static_cast<std::size_t>(z), image);
    read_bmp(file, image, {out, slice_bytes()});
  }

 private:
  std::size_t slice_bytes() const { return static_cast<std::size_t>(first_.width * first_.height); }

  void require_like_first(std::size_t z, const BmpImage& image) const {
    if (image.width != first_.width || image.height != first_.height)
      throw BrokenInput("{}: BMP file: has {} x {} samples, but {} has {} x {}", files[z], image.width,
                        image.height, files.front(), first_.width, first_.height);
  }

  std::size_t slices_;  // files of logs come after those of slices
  BmpImage first_;
};

}  // namespace
}  // namespace tagrid

int main() {
  return tagrid::serve_volumes("bmp", [](const std::string& path, const tagrid::ReaderOptions& options) {
    return tagrid::open_slices<tagrid::BmpSlices>(path, {".bmp"}, options);
  });
}
