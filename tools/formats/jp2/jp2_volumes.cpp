// tagrid-read-jp2: reads folders of JPEG 2000 slices with OpenJPEG.

#include <fmt/format.h>

#include <string>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/byte_source.h"
#include "tools/formats/codecs/jpeg2000.h"
#include "tools/formats/jp2/outline.h"
#include "tools/formats/slice_files.h"

namespace tagrid {
namespace {

SampleType type_of(const std::string& path, const Jpeg2000Image& image) {
  if (image.bits <= 8) return image.is_signed ? SampleType::int8 : SampleType::uint8;
  if (image.bits <= 16) return image.is_signed ? SampleType::int16 : SampleType::uint16;
  if (image.bits <= 31) return SampleType::int32;
  throw BrokenInput(
      fmt::format("{}: JPEG 2000 file: samples of {} bits are not supported", path, image.bits));
}

std::string in_words(const Jpeg2000Image& image) {
  return fmt::format("{} x {} samples of {} bits", image.width, image.height, image.bits);
}

class Jp2Slices final : public ServedVolume {
 public:
  explicit Jp2Slices(std::vector<std::string> paths) {
    files = std::move(paths);
    bool is_lossless = true;
    for (const std::string& path : files) {
      say_working();
      look_at_outline(path);
      const Jpeg2000Image image = jpeg2000_header(path);
      is_lossless = is_lossless && image.is_lossless;
      if (path == files.front()) {
        first_ = image;
        type = type_of(path, image);
      } else {
        require_like_first(path, image);
      }
    }
    dims = {first_.width, first_.height, static_cast<std::int64_t>(files.size())};
    // The decoder has each sample as 4 bytes, twice, and the stream.
    memory = static_cast<std::uint64_t>(first_.width * first_.height) * 16;
    // A loss is not undone by a lossless copy.
    if (!is_lossless) pairs.emplace_back(lossy_source_key, "JPEG 2000, irreversible wavelet (9-7)");
    add_bytes_after(after_, warnings);
  }

  void read_slice(std::int64_t z, std::byte* out) override {
    const std::string& path = files[static_cast<std::size_t>(z)];
    const Jpeg2000Image image = decode_jpeg2000_file(path);
    require_like_first(path, image);
    const std::size_t size = size_of(type);
    for (std::size_t i = 0; i < image.samples.size(); ++i) switch (size) {
        case 1:
          out[i] = static_cast<std::byte>(image.samples[i]);
          break;
        case 2:
          store_little_endian(out + 2 * i, static_cast<std::uint16_t>(image.samples[i]));
          break;
        default:
          store_little_endian(out + 4 * i, image.samples[i]);
      }
  }

 private:
  void require_like_first(const std::string& path, const Jpeg2000Image& image) const {
    if (image.width != first_.width || image.height != first_.height || image.bits != first_.bits ||
        image.is_signed != first_.is_signed)
      throw BrokenInput(fmt::format("{}: JPEG 2000 file: has {}, but {} has {}", path, in_words(image),
                                    files.front(), in_words(first_)));
  }

  void look_at_outline(const std::string& path) {
    const Jp2Outline outline = jp2_outline(FileSource(path));
    if (outline.has_palette)
      throw BrokenInput(path +
                        ": JPEG 2000 file: its samples are colors of a palette, not single numbers; convert "
                        "it to grayscale "
                        "first, in the program that knows what the colors mean");
    if (outline.images > 1)
      not_understood.push_back(fmt::format("{}: the file has {} images, of which only the first one is read",
                                           path, outline.images));
    if (outline.has_extensions)
      not_understood.push_back(
          path + ": it says that it needs extensions of JPEG 2000 (part 2), which may change samples");
    if (outline.after > 0) after_.push_back({path, outline.after});
  }

  Jpeg2000Image first_;
  std::vector<BytesAfter> after_;
};

}  // namespace
}  // namespace tagrid

int main() {
  return tagrid::serve_volumes("jp2", [](const std::string& path, const tagrid::ReaderOptions& options) {
    return tagrid::open_slices<tagrid::Jp2Slices>(path, {".jp2", ".j2k", ".j2c", ".jpc", ".jpx"}, options);
  });
}
