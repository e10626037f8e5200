#include "io/formats/tiff/reader/tiff_file.h"

#include <fmt/format.h>
#include <tiffio.h>
#include <pugixml.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <limits>
#include <span>
#include <string_view>

#include "io/errors/errors.h"
#include "io/formats/tiff/reader/directories.h"
#include "io/formats/tiff/reader/libtiff.h"
#include "io/system/files.h"
#include "io/text/foreign_number.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// True if a file has the magic of TIFF or BigTIFF, in either byte order.
bool begins_tiff(const std::string& path) {
  std::array<char, 4> magic = {};
  std::ifstream(path_of(path), std::ios::binary).read(magic.data(), magic.size());
  const std::string_view begin(magic.data(), magic.size());
  const auto is_version = [](char c) { return c == 42 || c == 43; };
  return begin.starts_with("II") ? is_version(begin[2]) && begin[3] == 0
                                 : begin.starts_with("MM") && begin[2] == 0 && is_version(begin[3]);
}

// libtiff opens files with functions of the system, of which Windows has others than Linux. So it gets ours.

int file_of(thandle_t file) { return static_cast<int>(reinterpret_cast<std::intptr_t>(file)); }

tmsize_t read_of_file(thandle_t file, void* to, tmsize_t size) {
  tmsize_t done = 0;
  while (done < size) {
    const std::span<std::byte> rest(static_cast<std::byte*>(to) + done,
                                    static_cast<std::size_t>(size - done));
    const std::ptrdiff_t count = files().read(file_of(file), rest);
    if (count < 0) return -1;
    if (count == 0) break;
    done += count;
  }
  return done;
}

tmsize_t write_to_file(thandle_t, void*, tmsize_t) { return -1; }

toff_t size_of_file(thandle_t file) {
  FileStatus status;
  return files().status(file_of(file), status) ? status.size : 0;
}

toff_t seek_in_file(thandle_t file, toff_t offset, int whence) {
  if (whence == SEEK_CUR) offset += static_cast<toff_t>(files().position(file_of(file)));
  if (whence == SEEK_END) offset += size_of_file(file);
  return files().seek(file_of(file), offset) ? offset : std::numeric_limits<toff_t>::max();
}

int close_file(thandle_t file) { return files().close(file_of(file)) ? 0 : -1; }

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
  const auto handle = reinterpret_cast<thandle_t>(std::intptr_t{descriptor});
  if (is_file)
    tiff_.reset(TIFFClientOpen(path.c_str(), "rm", handle, read_of_file, write_to_file, seek_in_file,
                               close_file, size_of_file, nullptr, nullptr));
  if (!tiff_) {
    if (!is_file) throw BrokenInput(path + ": is not a regular file");
    if (!begins_tiff(path)) throw BrokenInput(path + ": is not a TIFF file");
    fail("ends too soon, or is damaged" + (last_reason.empty() ? "" : fmt::format(" ({})", last_reason)));
  }
  descriptor.release();
  size_ = status.size;
}

void TiffFile::fail(const std::string& why) const {
  throw BrokenInput("{}: TIFF file: {}", path_, why.empty() ? "cannot be read" : why);
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

// Tags of other programs that change which samples there are in a TIFF file, or what they mean.

namespace {

constexpr std::uint16_t tag_of_pixel_scale = 33550, tag_of_transformation = 34264;  // GeoTIFF
constexpr std::uint32_t tag_of_stk = 33629;

/// Tags in which programs store which pages are channels and moments.
struct OwnOrder {
  std::uint32_t tag;
  const char* program;
};
constexpr std::array own_orders = {OwnOrder{34412, "Zeiss LSM"}, OwnOrder{34361, "FluoView"},
                                   OwnOrder{51123, "Micro-Manager"}};

/// The values of a tag of which libtiff knows no more than its type: how many there are, and the bytes of
/// all.
struct Values {
  std::uint32_t count = 0;
  const void* data = nullptr;
};

Values values_of(TIFF* tiff, std::uint32_t tag) {
  const TIFFField* field = TIFFFindField(tiff, tag, TIFF_ANY);
  Values values;
  if (field == nullptr) return values;
  if (TIFFFieldPassCount(field) == 0) {
    // Of texts, which end by themselves.
    if (TIFFFieldDataType(field) == TIFF_ASCII && TIFFGetField(tiff, tag, &values.data) == 1)
      values.count =
          static_cast<std::uint32_t>(std::string_view(static_cast<const char*>(values.data)).size());
  } else if (TIFFFieldReadCount(field) == TIFF_VARIABLE2) {
    if (TIFFGetField(tiff, tag, &values.count, &values.data) != 1) return {};
  } else {
    std::uint16_t count = 0;
    if (TIFFGetField(tiff, tag, &count, &values.data) != 1) return {};
    values.count = count;
  }
  return values;
}

/// The text of such a tag; nothing if it is absent. A tag that is no text has an unreadable one.
std::optional<std::string> text_of(TIFF* tiff, std::uint32_t tag) {
  const TIFFField* field = TIFFFindField(tiff, tag, TIFF_ANY);
  const Values values = values_of(tiff, tag);
  if (field == nullptr || values.data == nullptr) return std::nullopt;
  if (TIFFFieldDataType(field) != TIFF_ASCII) return "(binary)";
  const std::string_view text(static_cast<const char*>(values.data), values.count);
  return std::string(text.substr(0, text.find('\0')));
}

/// GDAL: value = SCALE * sample + OFFSET, in UNITTYPE.
void read_scale(const std::string& text, TiffPage& page, TiffRemarks& remarks) {
  pugi::xml_document document;
  if (!document.load_buffer(text.data(), text.size()))
    return remarks.doubt("GDAL's metadata, which may give values a scale, cannot be read");
  for (const pugi::xml_node& item : document.document_element().children("Item")) {
    const std::string role = lower_case(item.attribute("role").as_string());
    const std::string content = item.text().as_string();
    if (role == "unittype") page.rescale.units = std::string(trimmed(content));
    if (role != "scale" && role != "offset") continue;
    const std::string name = fmt::format("the {} of values in GDAL's metadata", role);
    const ForeignNumber number = foreign_number(content);
    const bool is_good = number.is_number() && (role == "offset" || number.value != 0);
    if (number.decimal_comma)
      remarks.warn(remark_on(number, name, ""));
    else if (!is_good)
      remarks.doubt(fmt::format("{} is {}, which is none", name, tagrid::quoted(content)));
    if (is_good) (role == "scale" ? page.rescale.slope : page.rescale.intercept) = number.value;
  }
}

bool is_sample(double value, SampleType type) {
  return with_sample_type(type, [&](auto sample) {
    using T = decltype(sample);
    if constexpr (std::numeric_limits<T>::is_integer)
      return std::trunc(value) == value && value >= static_cast<double>(std::numeric_limits<T>::min()) &&
             value <= static_cast<double>(std::numeric_limits<T>::max());
    else
      return true;
  });
}

/// GDAL: a sample that stands for none. It is also that of strips and tiles which nobody wrote.
void read_no_data(const std::string& text, TiffPage& page, TiffRemarks& remarks) {
  const ForeignNumber number = foreign_number(text);
  const std::optional<double> value = number.is_number() ? number.value : number_of(trimmed(text));
  if (!value)
    return remarks.miss(
        fmt::format("GDAL_NODATA is {}, which is not a number; which samples mean no data is not known",
                    tagrid::quoted(text)));
  if (!is_sample(*value, page.type)) return;  // No sample is meant then.
  page.fill = *value;
  remarks.miss(fmt::format(
      "samples of {} mean that there are no data (GDAL_NODATA); they are read as samples", trimmed(text)));
}

/// Reports what the tags of other programs may change, and the tags that libtiff ignores. Throws BrokenInput,
/// without the name of a file, if samples would be left out.
void look_at_other_tags(const TiffDirectory& directory, TiffPage& page, TiffRemarks& remarks) {
  for (const TiffField& field : directory.fields) {
    for (const OwnOrder& one : own_orders)
      if (one.tag == field.tag)
        page.unread_order = fmt::format(
            "it is a file of {}, and what that says of channels and moments is not read", one.program);
    if (field.tag == TIFFTAG_GRAYRESPONSECURVE)
      remarks.miss("GrayResponseCurve gives its samples optical densities, which are not read");
    if (field.tag == tag_of_stk && field.count > 1)
      throw BrokenInput(
          "is a stack of MetaMorph (STK) with {} slices in one page, which is not read; save it "
          "as a TIFF file with a page for each slice",
          field.count);
    // Without such a compression, some programs undo a predictor, and others do not.
    if (field.tag == TIFFTAG_PREDICTOR && !page.may_have_predictor)
      remarks.miss(
          "it has a Predictor, but no compression to which one belongs; samples are read as they are");
    if (field.tag == tag_of_pixel_scale || field.tag == tag_of_transformation)
      remarks.warn("its place on the Earth (GeoTIFF) is not read, and gives no spacing");
  }
}

}  // namespace

/// Of GDAL (https://gdal.org/drivers/raster/gtiff.html): a scale of values, and the sample that stands for
/// none.
void TiffFile::look_at_values(TiffPage& page) {
  if (const auto text = text_of(tiff_.get(), TIFFTAG_GDAL_METADATA)) read_scale(*text, page, remarks_);
  if (const auto text = text_of(tiff_.get(), TIFFTAG_GDAL_NODATA)) read_no_data(*text, page, remarks_);
}

/// The pages have the same kinds of tags, so the first one is enough.
void TiffFile::look_at_tags(TiffPage& first) {
  try {
    look_at_other_tags(TiffDirectories(path_).at(first.directory), first, remarks_);
  } catch (const NoPlainForm& broken) {
    remarks_.miss(fmt::format("a tag of it cannot be read ({})", broken.why));
  } catch (const BrokenInput& left_out) {
    fail(left_out.what());
  }
}

}  // namespace tagrid
