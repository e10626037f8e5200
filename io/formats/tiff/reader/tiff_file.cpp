#include "io/formats/tiff/reader/tiff_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <limits>
#include <string_view>

#include "io/errors/errors.h"
#include "io/formats/tiff/reader/directories.h"
#include "io/formats/tiff/reader/libtiff.h"
#include "io/system/files.h"

namespace tagrid {
namespace {

/// True if a file has the magic of TIFF or BigTIFF, in either byte order.
bool begins_tiff(const std::string& path) {
  std::array<char, 4> magic = {};
  std::ifstream(path, std::ios::binary).read(magic.data(), magic.size());
  const std::string_view begin(magic.data(), magic.size());
  const auto is_version = [](char c) { return c == 42 || c == 43; };
  return begin.starts_with("II") ? is_version(begin[2]) && begin[3] == 0
                                 : begin.starts_with("MM") && begin[2] == 0 && is_version(begin[3]);
}

}  // namespace

TiffFile::TiffFile(const std::string& path) : path_(path) {
  listen_to_libtiff();
  last_reason.clear();
  of_tags = {};
  Descriptor descriptor = files().open(path, {.read = true, .waits = false});
  if (descriptor < 0) throw world_error("cannot open", path, errno);
  FileStatus status;
  const bool is_file = files().status(descriptor, status) && status.is_file();
  // m: without mapping the file, whose damage would end the program
  if (is_file) tiff_.reset(TIFFFdOpen(descriptor, path.c_str(), "rm"));
  if (!tiff_) {
    if (!is_file) throw BrokenInput(path + ": is not a regular file");
    if (!begins_tiff(path)) throw BrokenInput(path + ": is not a TIFF file");
    fail("ends too soon, or is damaged" + (last_reason.empty() ? "" : fmt::format(" ({})", last_reason)));
  }
  descriptor.release();
  size_ = status.size;
}

void TiffFile::fail(const std::string& why) const {
  throw BrokenInput(fmt::format("{}: TIFF file: {}", path_, why.empty() ? "cannot be read" : why));
}

std::vector<TiffPage> TiffFile::pages() {
  std::vector<TiffPage> pages, left_out;
  std::int64_t number = 0;
  do {
    // Small images for previews are no slices.
    if (TiffPage size = size_of_page(); is_preview_or_mask(size, pages)) {
      left_out.push_back(std::move(size));
    } else {
      pages.push_back(current_page());
      pages.back().number = number;
      if (pages.size() == 1) look_at_tags(pages.front());
    }
    remarks_.add(of_tags);
    of_tags = {};
    ++number;
    last_reason.clear();
  } while (TIFFReadDirectory(tiff_.get()) == 1);
  if (!last_reason.empty()) fail(fmt::format("ends too soon, or is damaged ({})", last_reason));
  // libtiff stops at a directory that it has met before.
  if (TIFFLastDirectory(tiff_.get()) == 0)
    fail("its pages lead in circles: one is followed by an earlier one");
  if (pages.empty()) fail("has no image");
  look_at_left_out(pages, left_out);
  return pages;
}

std::string TiffFile::description() const {
  const char* text = nullptr;
  const bool has_one = TIFFGetField(tiff_.get(), TIFFTAG_IMAGEDESCRIPTION, &text) == 1 && text != nullptr;
  return has_one ? text : "";
}

TiffPage TiffFile::size_of_page() const {
  TiffPage page;
  page.directory = TIFFCurrentDirOffset(tiff_.get());
  page.width = value_of<std::uint32_t>(tiff_.get(), TIFFTAG_IMAGEWIDTH, 0);
  page.height = value_of<std::uint32_t>(tiff_.get(), TIFFTAG_IMAGELENGTH, 0);
  return page;
}

bool TiffFile::is_preview_or_mask(const TiffPage& page, const std::vector<TiffPage>& slices) const {
  constexpr std::uint32_t not_full = FILETYPE_REDUCEDIMAGE | FILETYPE_MASK;
  if ((value_of<std::uint32_t>(tiff_.get(), TIFFTAG_SUBFILETYPE, 0) & not_full) != 0) return true;
  if (!slices.empty() && page.width == slices.front().width && page.height == slices.front().height)
    return false;
  // libtiff ignores the older tag.
  try {
    const TiffDirectories file(path_);
    return file.number_of(file.at(page.directory), TIFFTAG_OSUBFILETYPE, 0) == OFILETYPE_REDUCEDIMAGE;
  } catch (const NoPlainForm&) {
    return false;  // it is an image, or is refused as one
  }
}

/// Previews and masks are smaller than slices. Full-size ones may be slices with a wrong mark.
void TiffFile::look_at_left_out(const std::vector<TiffPage>& pages, const std::vector<TiffPage>& left_out) {
  const auto is_full = [&](const TiffPage& page) {
    return page.width >= pages.front().width && page.height >= pages.front().height;
  };
  if (const auto full = std::ranges::count_if(left_out, is_full); full > 0)
    remarks_.miss(fmt::format(
        "{} of its pages are previews or masks by their SubfileType, but not smaller than slices; "
        "they are not read",
        full));
}

/// Most images below a page are smaller copies of it.
void TiffFile::look_at_sub_images(const TiffPage& page) {
  std::uint16_t count = 0;
  const std::uint64_t* places = nullptr;
  if (TIFFGetField(tiff_.get(), TIFFTAG_SUBIFD, &count, &places) != 1 || places == nullptr) return;
  try {
    const TiffDirectories file(path_);
    for (std::uint16_t i = 0; i < count; ++i) {
      const TiffDirectory below = file.at(places[i]);
      if (file.number_of(below, TIFFTAG_IMAGEWIDTH, 0) < page.width ||
          file.number_of(below, TIFFTAG_IMAGELENGTH, 0) < page.height)
        continue;
      remarks_.miss(
          "there are images below its pages (SubIFDs) that are no smaller copies; they are not read");
    }
  } catch (const NoPlainForm& broken) {
    remarks_.miss("the images below its pages (SubIFDs) cannot be read: " + broken.why);
  }
}

TiffPage TiffFile::current_page() {
  TIFF* tiff = tiff_.get();
  TiffPage page = size_of_page();
  require_readable(page);
  const auto [type, packed_bits] = kind_of_samples();
  page.type = type;
  page.packed_bits = packed_bits;
  check_pieces(page);
  page.is_lossy = !is_lossless(value_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE));
  page.may_have_predictor =
      may_have_predictor(value_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE));
  page.may_be_swapped =
      page.may_have_predictor && TIFFIsBigEndian(tiff) != 0 &&
      value_of<std::uint16_t>(tiff, TIFFTAG_PREDICTOR, PREDICTOR_NONE) == PREDICTOR_FLOATINGPOINT;
  page.storage = name_of_storage(tiff, page);
  page.zero_is_white =
      value_of<std::uint16_t>(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) == PHOTOMETRIC_MINISWHITE;
  page.orientation = value_of<std::uint16_t>(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
  page.description = description();
  if (float x = 0; TIFFGetField(tiff, TIFFTAG_XRESOLUTION, &x) == 1) page.x_resolution = x;
  if (float y = 0; TIFFGetField(tiff, TIFFTAG_YRESOLUTION, &y) == 1) page.y_resolution = y;
  // Not the default of the standard.
  if (std::uint16_t unit = 0; TIFFGetField(tiff, TIFFTAG_RESOLUTIONUNIT, &unit) == 1)
    page.resolution_unit = unit;
  look_at_values(page);
  look_at_sub_images(page);
  page.plain = plain_place(page);
  page.big_endian = TIFFIsBigEndian(tiff) != 0;
  page.memory = memory_for_page();
  return page;
}

void TiffFile::require_readable(const TiffPage& page) const {
  TIFF* tiff = tiff_.get();
  if (page.width == 0 || page.height == 0) fail("an image without width or height");
  constexpr std::uint32_t most = std::numeric_limits<std::int32_t>::max();
  if (page.width > most || page.height > most)
    fail(fmt::format("an image of {} x {} pixels is too large", page.width, page.height));
  require_single_numbers();
  const auto scheme = value_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  if (!is_lossless(scheme) && scheme != COMPRESSION_JPEG)
    fail(fmt::format(
        "is compressed by {}, which is not read; save it uncompressed, or by deflate, LZW or zstd",
        name_of_compression(scheme)));
  if (TIFFIsCODECConfigured(scheme) == 0)
    fail(fmt::format("scheme {} of compression is missing in libtiff", scheme));
  if (value_of<std::uint32_t>(tiff, TIFFTAG_IMAGEDEPTH, 1) != 1)
    fail("an image of several slices (ImageDepth) is not read");
}

void TiffFile::require_single_numbers() const {
  TIFF* tiff = tiff_.get();
  const auto samples = value_of<std::uint16_t>(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
  const auto meaning = value_of<std::uint16_t>(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  const bool is_gray = meaning == PHOTOMETRIC_MINISBLACK || meaning == PHOTOMETRIC_MINISWHITE;
  if (is_gray && samples != 1)
    fail(fmt::format("its pixels have {} samples each; write each of these into a file of its own first",
                     samples));
  const bool is_indexed = value_of<std::uint16_t>(tiff, TIFFTAG_INDEXED, 0) != 0;
  if (!is_gray || is_indexed)
    fail(fmt::format(
        "its pixels are {}, not single numbers; convert it to grayscale first, in the program that "
        "knows what they mean",
        is_indexed ? "colors of a palette" : name_of_meaning(meaning)));
}

TiffFile::Samples TiffFile::kind_of_samples() {
  const auto bits = value_of<std::uint16_t>(tiff_.get(), TIFFTAG_BITSPERSAMPLE, 1);
  const auto format = value_of<std::uint16_t>(tiff_.get(), TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  const bool is_unsigned = format == SAMPLEFORMAT_UINT || format == SAMPLEFORMAT_VOID;
  if (format == SAMPLEFORMAT_VOID)
    remarks_.miss(
        "SampleFormat says that nothing is known of its samples; they are read as unsigned integers");
  const auto integer = bits % 8 == 0 ? integer_type(bits / 8, !is_unsigned) : std::nullopt;
  if (integer && (is_unsigned || format == SAMPLEFORMAT_INT)) return {*integer};
  if (is_unsigned && bits >= 1 && bits <= 15)
    return {bits < 8 ? SampleType::uint8 : SampleType::uint16, static_cast<int>(bits)};
  if (format == SAMPLEFORMAT_IEEEFP && bits == 32) return {SampleType::float32};
  if (format == SAMPLEFORMAT_IEEEFP && bits == 64) return {SampleType::float64};
  const char* kind = is_unsigned                     ? "unsigned integers"
                     : format == SAMPLEFORMAT_INT    ? "integers"
                     : format == SAMPLEFORMAT_IEEEFP ? "floats"
                     : format == SAMPLEFORMAT_COMPLEXINT || format == SAMPLEFORMAT_COMPLEXIEEEFP
                         ? "complex numbers"
                         : "of an unknown SampleFormat and";
  fail(
      fmt::format("samples are {} of {} bits; integers of 8, 16 and 32 bits, unsigned ones of 1 to 15, and "
                  "floats of 32 and 64 can be read",
                  kind, bits));
}

}  // namespace tagrid
