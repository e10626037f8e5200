// One TIFF file: its pages, and their samples. On libtiff (https://libtiff.gitlab.io/libtiff/).
#pragma once

#include <tiffio.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "stages/volume/sample_type.h"

namespace tagrid {

/// An image in a TIFF file: one slice.
struct TiffPage {
  std::uint64_t directory = 0;  ///< byte of the file at which its description lies
  std::uint32_t width = 0, height = 0;
  SampleType type = SampleType::uint8;
  int packed_bits =
      0;  ///< of a sample, if they are packed: they are widened to `type`; 0 if samples have its size
  bool is_lossy = false;  ///< compressed with a loss
  std::string storage;    ///< how its samples are stored, for users: "LZW"
  /// The byte at which its samples begin, if they lie there plainly, in raster order.
  std::optional<std::uint64_t> plain;
  std::string description;  ///< ImageDescription: text, in which programs keep what TIFF has no tags for
  double x_resolution = 0,
         y_resolution = 0;  ///< pixels in a unit, which TIFF files of volumes rarely name; 0: not given
  bool zero_is_white = false;
  /// Where its first row and column are to be shown; 1: at the top and at the left.
  std::uint16_t orientation = 1;
  bool big_endian = false;
  std::uint64_t memory = 0;  ///< bytes that reading takes, besides the samples

  /// Bytes of a row as it is stored, uncompressed.
  std::uint64_t row_in_file() const {
    return packed_bits == 0 ? width * size_of(type)
                            : (std::uint64_t{width} * static_cast<std::uint64_t>(packed_bits) + 7) / 8;
  }
  std::uint64_t bytes() const { return std::uint64_t{width} * height * size_of(type); }
};

class TiffFile {
 public:
  /// Throws WorldError if the file cannot be opened, BrokenInput if it is no TIFF file.
  explicit TiffFile(const std::string& path);

  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }

  /// All pages, in the order of the file. Throws BrokenInput for a page that is broken, or whose samples are not
  /// single numbers of a type that tagrid knows.
  std::vector<TiffPage> pages();

  /// Reads the samples of a page, in the byte order of memory. Throws BrokenInput.
  void read(const TiffPage& page, std::byte* out);

 private:
  struct Samples {
    SampleType type;
    int packed_bits = 0;
  };
  TiffPage current_page();
  void require_readable(const TiffPage& page) const;
  Samples kind_of_samples() const;
  std::optional<std::uint64_t> plain_place(const TiffPage& page) const;
  std::uint64_t memory_for_page() const;
  void read_strips(const TiffPage& page, std::byte* out);
  void read_tiles(const TiffPage& page, std::byte* out);
  [[noreturn]] void fail(const std::string& why) const;

  struct Close {
    void operator()(TIFF* tiff) const { TIFFClose(tiff); }
  };
  std::string path_;
  std::uint64_t size_ = 0;
  std::unique_ptr<TIFF, Close> tiff_;
};

}  // namespace tagrid
