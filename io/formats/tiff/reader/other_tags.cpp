// Tags of other programs that change which samples there are in a TIFF file, or what they mean.
#include <fmt/format.h>
#include <tiffio.h>

#include <array>
#include <cmath>
#include <limits>
#include <pugixml.hpp>
#include <string_view>

#include "io/errors/errors.h"
#include "io/formats/tiff/reader/directories.h"
#include "io/formats/tiff/reader/tiff_file.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"

namespace tagrid {
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
          fmt::format("is a stack of MetaMorph (STK) with {} slices in one page, which is not read; save it "
                      "as a TIFF file with a page for each slice",
                      field.count));
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
