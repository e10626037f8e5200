// tagrid-read-jp2: reads folders of JPEG 2000 slices with OpenJPEG.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/formats/codecs/jpeg2000.h"
#include "io/formats/slices/slice_files.h"
#include "io/metadata/loss.h"
#include "io/programs/stored_samples.h"
#include "io/text/paths.h"

namespace tagrid {
namespace {

/// The contents of a JPEG 2000 file besides the image that is read: ISO/IEC 15444-1, annexes A and I.
struct Jp2Outline {
  std::uint64_t images = 0;  ///< code streams; 0 if none was found
  std::uint64_t after = 0;   ///< bytes after the last box, or after the end of the code stream
  bool has_palette = false;  ///< Samples are numbers of colors.
  /// Samples per meter along x and y when they were captured; 0 if that is not stated.
  double x_per_meter = 0, y_per_meter = 0;
  bool has_extensions =
      false;  ///< The code stream says that it needs more than part 1 of the standard, and part 15.
};

/// The number of `size` bytes at `at`, the highest one first; nothing beyond `end`.
std::optional<std::uint64_t> number(const ByteSource& file, std::uint64_t at, std::size_t size,
                                    std::uint64_t end) {
  std::array<std::byte, 8> bytes = {};
  if (at > end || end - at < size) return std::nullopt;
  file.read_at(at, std::span(bytes).first(size));
  return number_in(std::span(bytes).first(size), true);
}

constexpr std::uint64_t start_of_tile = 0xff90, end_of_stream = 0xffd9, start_of_stream = 0xff4f;

/// The byte after a code stream, whose tiles say how long they are; `end` if one does not, or is damaged.
std::uint64_t end_of_code_stream(const ByteSource& file, std::uint64_t at, std::uint64_t end) {
  at += 2;  // the start of the stream has no length
  while (const auto marker = number(file, at, 2, end)) {
    if (*marker == end_of_stream) return at + 2;
    const bool is_tile = *marker == start_of_tile;
    const auto length = is_tile ? number(file, at + 6, 4, end) : number(file, at + 2, 2, end);
    // A tile counts its marker, and is the last one if its length is 0. Others count their length.
    if (!length || *length < 2 || *length > end - at) return end;
    at += *length + (is_tile ? 0 : 2);
  }
  return end;
}

/// Walks over boxes, and over the parts of code streams, without decoding any. Of damaged files, which the
/// decoder refuses, as far as it comes. Safe for any bytes. Throws WorldError.
class Walk {
 public:
  explicit Walk(const ByteSource& file) : file_(file) {
    const std::uint64_t size = file.size();
    if (number(file, 0, 2, size) == start_of_stream) {
      add_code_stream(0, size);
      return;
    }
    const std::uint64_t end = boxes(0, size, 0);
    outline.after += size - end;
  }

  Jp2Outline outline;

 private:
  static constexpr std::uint64_t box(std::string_view name) {
    std::uint64_t value = 0;
    for (const char c : name) value = value << 8 | static_cast<unsigned char>(c);
    return value;
  }

  /// Returns where the last box ends. A length of 0 is that of all that is left, and 1 says that a longer
  /// number follows.
  std::uint64_t boxes(std::uint64_t at, std::uint64_t end, int depth) {
    while (at < end) {
      auto length = number(file_, at, 4, end);
      const auto name = number(file_, at + 4, 4, end);
      std::uint64_t head = 8;
      if (length == 1) {
        length = number(file_, at + 8, 8, end);
        head = 16;
      }
      if (length == 0) length = end - at;
      if (!length || !name || *length < head || *length > end - at) return at;
      if (*name == box("jp2c")) add_code_stream(at + head, at + *length);
      if (*name == box("pclr")) outline.has_palette = true;
      if (*name == box("resc") && depth == 2) read_resolution(at + head, at + *length);
      if (*name == box("res ") && depth == 1) boxes(at + head, at + *length, 2);
      if (*name == box("jp2h") && depth == 0) boxes(at + head, at + *length, 1);
      at += *length;
    }
    return end;
  }

  /// The capture resolution. The display resolution only tells how large to show an image.
  void read_resolution(std::uint64_t at, std::uint64_t end) {
    const auto along = [&](std::uint64_t ratio, std::uint64_t exponent) {
      const auto above = number(file_, at + ratio, 2, end), below = number(file_, at + ratio + 2, 2, end),
                 power = number(file_, at + exponent, 1, end);
      if (!above || !below || !power || *below == 0) return 0.0;
      double resolution = static_cast<double>(*above) / static_cast<double>(*below);
      for (int ten = static_cast<std::int8_t>(*power); ten != 0; ten += ten > 0 ? -1 : 1)
        resolution = ten > 0 ? resolution * 10 : resolution / 10;
      return resolution;
    };
    outline.y_per_meter = along(0, 8);
    outline.x_per_meter = along(4, 9);
  }

  void add_code_stream(std::uint64_t at, std::uint64_t end) {
    ++outline.images;
    constexpr std::uint64_t extensions = 0x8000;
    if (const auto needs = number(file_, at + 6, 2, end); needs && (*needs & extensions) != 0)
      outline.has_extensions = true;
    outline.after += end - std::min(end, end_of_code_stream(file_, at, end));
  }

  const ByteSource& file_;
};

SampleType type_of(const std::string& path, const Jpeg2000Image& image) {
  if (image.bits <= 16) return *integer_type(image.bits <= 8 ? 1 : 2, image.is_signed);
  if (image.bits <= 31) return SampleType::int32;
  throw BrokenInput("{}: JPEG 2000 file: samples of {} bits are not supported", path, image.bits);
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
    say_what_is_not_read();
    add_bytes_after(after_, warnings);
    constexpr double meter = 1000;  // millimeters
    resolution_.describe(files.front(), meter, geometry, warnings);
  }

  void read_slice(std::int64_t z, std::byte* out) override {
    const std::string& path = files[static_cast<std::size_t>(z)];
    const Jpeg2000Image image = decode_jpeg2000_file(path);
    require_like_first(path, image);
    store_samples(image, size_of(type), out);
    swap_if_not_native(out, image.samples.size(), size_of(type), false);
  }

 private:
  void require_like_first(const std::string& path, const Jpeg2000Image& image) const {
    if (image.width != first_.width || image.height != first_.height || image.bits != first_.bits ||
        image.is_signed != first_.is_signed)
      throw BrokenInput("{}: JPEG 2000 file: has {}, but {} has {}", path, in_words(image), files.front(),
                        in_words(first_));
  }

  void look_at_outline(const std::string& path) {
    const Jp2Outline outline = Walk(FileSource(path)).outline;
    if (outline.has_palette)
      throw BrokenInput(path +
                        ": JPEG 2000 file: its samples are colors of a palette, not single numbers; convert "
                        "it to grayscale first, in the program that knows what the colors mean");
    with_more_images_ += outline.images > 1 ? 1 : 0;
    with_extensions_ += outline.has_extensions ? 1 : 0;
    if (outline.after > 0) after_.push_back({path, outline.after});
    resolution_.add(outline.x_per_meter, outline.y_per_meter);
  }

  /// Says it once of all slices, without the name of any.
  void say_what_is_not_read() {
    const std::filesystem::path first(path_of(files.front()));
    const std::string where = files.size() == 1 ? text_of(first) : text_of(first.parent_path());
    if (with_more_images_ > 0)
      not_understood.push_back(
          fmt::format("{}: {} of {} files have several images, of which only the first one is read", where,
                      with_more_images_, files.size()));
    if (with_extensions_ > 0)
      not_understood.push_back(fmt::format(
          "{}: {} of {} files say that they need extensions of JPEG 2000 (part 2), which may change samples",
          where, with_extensions_, files.size()));
  }

  std::size_t with_more_images_ = 0, with_extensions_ = 0;  ///< files
  Jpeg2000Image first_;
  std::vector<BytesAfter> after_;
  ResolutionOfSlices resolution_;
};

}  // namespace
}  // namespace tagrid

int main() {
  return tagrid::serve_volumes("jp2", [](const std::string& path, const tagrid::ReaderOptions& options) {
    return tagrid::open_slices<tagrid::Jp2Slices>(
        path, {".jp2", ".j2k", ".j2c", ".jpc", ".jpx", ".jph", ".jhc"}, options);
  });
}
