#include "io/formats/tiff/reader/descriptions.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/formats/slices/slice_files.h"
#include "io/metadata/lengths.h"
#include "io/metadata/loss.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// Of the OME model, and of ImageJ.
bool is_no_length(std::string_view unit) {
  return unit.empty() || unit == "pixel" || unit == "pixels" || unit == "reference frame";
}

/// Calls use(key, value) for each line "key=value".
template <class Use>
void for_each_field(std::string_view description, Use use) {
  while (!description.empty()) {
    const std::string_view line = take_line(description);
    if (const std::size_t equal = line.find('='); equal != line.npos)
      use(line.substr(0, equal), line.substr(equal + 1));
  }
}

std::int64_t count_from(std::string_view text) {
  constexpr std::int64_t most = std::int64_t{1} << 31;
  const auto count = whole_number_of(text);
  if (!count || *count < 1 || *count > most)
    throw BrokenInput("TIFF file: ImageJ's description has the number " + tagrid::quoted(text));
  return *count;
}

/// Pixels in a unit, as a length.
ForeignNumber length_of(const std::optional<double>& resolution) {
  if (!resolution) return {};
  ForeignNumber length = foreign_number(1 / *resolution);
  if (!(*resolution > 0)) length.outcome = ForeignNumber::Outcome::unreadable;
  length.text = fmt::format("{}", *resolution);
  return length;
}

/// The unit of a resolution; 0 if it has none.
double millimeters_of_unit(const TiffPage& page) {
  constexpr std::uint16_t inch = 2, centimeter = 3;
  return page.resolution_unit == inch ? 25.4 : page.resolution_unit == centimeter ? 10 : 0;
}

/// Why a straight line cannot be drawn; "" if it can.
std::string doubt_of_line(const ImageJCalibration& calibration) {
  constexpr const char* kept = "; numbers are kept as they are";
  for (const auto& [name, number] : {std::pair("c0", &calibration.c0), {"c1", &calibration.c1}}) {
    if (number->is_absent()) return fmt::format("ImageJ's calibration has no coefficient {}{}", name, kept);
    if (number->is_unreadable())
      return fmt::format("ImageJ's calibration has the coefficient {} = {}, which is not a number{}", name,
                         tagrid::quoted(number->text), kept);
  }
  if (calibration.c1.value == 0)
    return fmt::format("ImageJ's calibration has the coefficients {} and {}{}", calibration.c0.text,
                       calibration.c1.text, kept);
  return "";
}

/// The numbers of a list, without its brackets; nothing if there are others.
std::optional<std::vector<std::int64_t>> numbers_in(std::string_view list) {
  std::vector<std::int64_t> numbers;
  for (const std::string_view part : split(list, ',')) {
    const auto number = whole_number_of(trimmed(part));
    if (!number || *number < 1) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

/// What follows `key` in a text; "" if it is not there.
std::string_view after(std::string_view text, std::string_view key) {
  const std::size_t at = text.find(key);
  return at == text.npos ? "" : text.substr(at + key.size());
}

}  // namespace

std::string plain_unit(std::string_view unit) {
  const auto known = length_unit(unit);
  return known && known->name == "um" ? "um" : std::string(unit);
}

Geometry spacing_of(const std::array<GivenDistance, 3>& distances, TiffRemarks& remarks) {
  constexpr std::array axes = {"x", "y", "z"};
  Geometry geometry;
  std::string common;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& [name, number, unit] = distances[axis];
    const std::string unknown = fmt::format("the spacing along {} is unknown", axes[axis]);
    if (number.is_absent()) continue;
    if (number.is_unreadable() || number.decimal_comma) remarks.warn(remark_on(number, name, unknown));
    if (!number.is_number()) continue;
    if (number.value <= 0) {
      remarks.warn(
          fmt::format("{} is {}, which is no distance; {}", name, tagrid::quoted(number.text), unknown));
      continue;
    }
    if (is_no_length(unit)) {
      remarks.warn(
          fmt::format("{} has the unit {}, which is no length; {}", name, tagrid::quoted(unit), unknown));
      continue;
    }
    if (common.empty()) common = unit;
    const auto own = length_unit(unit), of_common = length_unit(common);
    if (unit != common && !(own && of_common)) {
      remarks.warn(fmt::format("{} has the unit {}, and another axis {}, which cannot be compared; {}", name,
                               tagrid::quoted(unit), tagrid::quoted(common), unknown));
      continue;
    }
    geometry.spacing[axis] = unit == common ? number.value : converted(number.value, *own, *of_common);
    geometry.has_spacing = true;
  }
  if (geometry.has_spacing) geometry.units.fill(common);
  return geometry;
}

std::optional<ImageJ> image_j_of(std::string_view description) {
  if (!description.starts_with("ImageJ=")) return std::nullopt;
  ImageJ found;
  bool has_slices = false;
  for_each_field(description, [&](std::string_view key, std::string_view value) {
    if (key == "images") found.images = count_from(value);
    if (key == "channels") found.channels = count_from(value);
    if (key == "frames") found.frames = count_from(value);
    if (key == "slices") {
      found.slices = count_from(value);
      has_slices = true;
    }
    if (key == "spacing") found.spacing = foreign_number(value);
    if (key == "unit") found.unit.fill(plain_unit(value));
    // They come after the unit, and only if they differ from it.
    if (key == "yunit") found.unit[1] = plain_unit(value);
    if (key == "zunit") found.unit[2] = plain_unit(value);
  });
  if (!has_slices) found.slices = found.images / (found.channels * found.frames);
  if (found.channels > found.images || found.frames > found.images || found.slices > found.images ||
      found.channels * found.frames > found.images ||
      found.channels * found.frames * found.slices != found.images)
    throw BrokenInput(
        "TIFF file: ImageJ's description says {} images, but {} channels, {} slices and {} frames",
        found.images, found.channels, found.slices, found.frames);
  return found;
}

Geometry spacing_of(const ImageJ& image_j, const TiffPage& first, TiffRemarks& remarks) {
  const std::string& unit = image_j.unit[0];
  if (unit == "pixel" || unit == "pixels") return {};
  ForeignNumber between = image_j.spacing;
  // ImageJ also ignores the sign.
  if (between.is_number() && between.value < 0) {
    between.value = -between.value;
    remarks.warn(fmt::format("ImageJ's spacing is {}; it is read as {}", between.text, between.value));
  }
  // ImageJ also keeps print resolutions, in inches.
  if (const auto known = length_unit(unit); unit.empty() || (known && known->name == "inch")) {
    TiffPage page = first;
    if (known) page.resolution_unit = 2;
    Geometry geometry = spacing_of(page, remarks);
    if (geometry.has_spacing && between.is_number() && between.value > 0)
      geometry.spacing[2] = between.value * millimeters_of_unit(page);
    return geometry;
  }
  return spacing_of({{{"XResolution", length_of(first.x_resolution), unit},
                      {"YResolution", length_of(first.y_resolution), image_j.unit[1]},
                      {"ImageJ's spacing", between, image_j.unit[2]}}},
                    remarks);
}

Geometry spacing_of(const TiffPage& page, TiffRemarks& remarks) {
  if (!page.x_resolution || !page.y_resolution) return {};
  const double x = *page.x_resolution, y = *page.y_resolution;
  if (const double millimeters = millimeters_of_unit(page); millimeters > 0) {
    SpacingOfSlice found = spacing_of_resolution(x, y, millimeters);
    remarks.warn(std::move(found.remark));
    return std::move(found.geometry);
  }
  if (x > 0 && y > 0 && (x != 1 || y != 1))
    remarks.warn(fmt::format("its resolution of {} x {} has no unit, so it is not a voxel size", x, y));
  return {};
}

std::optional<ImageJCalibration> calibration_of(std::string_view description) {
  if (!description.starts_with("ImageJ=")) return std::nullopt;
  ImageJCalibration found;
  bool has_function = false;
  for_each_field(description, [&](std::string_view key, std::string_view value) {
    if (key == "cf") found.function = std::string(trimmed(value));
    if (key == "cf") has_function = true;
    if (key == "c0") found.c0 = foreign_number(value);
    if (key == "c1") found.c1 = foreign_number(value);
    // The name that ImageJ gives to numbers without a unit.
    if (key == "vunit" && lower_case(value) != "gray value") found.unit = value;
  });
  constexpr const char* none = "20";
  if (!has_function || found.function == none) return std::nullopt;
  return found;
}

std::string loss_in(std::string_view description) {
  std::string loss;
  if (description.starts_with("ImageJ="))
    for_each_field(description, [&](std::string_view key, std::string_view value) {
      if (key == lossy_source_key) loss = value;
    });
  return loss;
}

CalibratedSamples calibrated(const ImageJCalibration& calibration, SampleType type) {
  CalibratedSamples samples;
  samples.type = type;
  // ImageJ calibrates no other numbers.
  if (type != SampleType::uint8 && type != SampleType::uint16 && type != SampleType::int16) return samples;
  const auto function = whole_number_of(calibration.function);
  if (!function) {
    samples.scale_doubt =
        fmt::format("the function of ImageJ's calibration is {}; numbers are kept as they are",
                    tagrid::quoted(calibration.function));
    return samples;
  }
  if (*function != 0) {
    samples.not_understood = fmt::format(
        "ImageJ's calibration is not a straight line (function {}); numbers are kept as they are", *function);
    return samples;
  }
  samples.scale_doubt = doubt_of_line(calibration);
  if (!samples.scale_doubt.empty()) return samples;
  for (const auto& [name, number] : {std::pair("c0", &calibration.c0), {"c1", &calibration.c1}})
    if (number->decimal_comma && samples.warning.empty())
      samples.warning =
          remark_on(*number, fmt::format("the coefficient {} of ImageJ's calibration", name), "");
  const double c0 = calibration.c0.value, c1 = calibration.c1.value;
  constexpr double half = 32768;
  samples.rescale.units = calibration.unit;
  if (type == SampleType::uint16 && c0 == -half && c1 == 1) {
    samples.type = SampleType::int16;
    samples.add = -static_cast<std::int32_t>(half);
    return samples;
  }
  samples.rescale.slope = c1;
  // In memory, ImageJ has signed numbers as unsigned ones, to which the calibration belongs.
  samples.rescale.intercept = type == SampleType::int16 ? c0 + c1 * half : c0;
  return samples;
}

TiffShape shape_in(std::string_view description) {
  TiffShape shape;
  const std::string_view list = after(description, "\"shape\": [");
  const std::size_t end = list.find(']');
  if (!description.starts_with('{') || end == list.npos) return shape;
  const auto numbers = numbers_in(list.substr(0, end));
  if (!numbers) return shape;
  const std::string_view axes = after(description, "\"axes\": \"");
  const std::string_view names = axes.substr(0, axes.find('"'));
  std::size_t long_axes = 0;
  for (std::size_t i = 0; i + 2 < numbers->size(); ++i) {
    const std::int64_t size = (*numbers)[i];
    if (__builtin_mul_overflow(shape.images, static_cast<std::size_t>(size), &shape.images)) return {};
    if (size == 1) continue;
    // Z: slices; I and Q: of a sequence, and nobody knows.
    const bool is_other =
        names.size() == numbers->size() && std::string_view("ZIQ").find(names[i]) == names.npos;
    if (++long_axes > 1 || is_other) shape.is_of_slices = false;
    shape.text += (shape.text.empty() ? "" : " x ") + std::to_string(size);
  }
  if (!names.empty()) shape.text += fmt::format(" ({})", tagrid::quoted(names));
  shape.is_truncated = description.find("\"truncated\": true") != description.npos;
  return shape;
}

}  // namespace tagrid
