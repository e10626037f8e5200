#include "tools/formats/tiff/calibration.h"

#include <fmt/format.h>

#include <utility>

#include "io/text/text.h"

namespace tagrid {

std::optional<ImageJCalibration> calibration_of(std::string_view description) {
  if (!description.starts_with("ImageJ=")) return std::nullopt;
  ImageJCalibration found;
  bool has_function = false;
  while (!description.empty()) {
    const std::string_view line = take_line(description);
    const std::size_t equal = line.find('=');
    if (equal == line.npos) continue;
    const std::string_view key = line.substr(0, equal), value = line.substr(equal + 1);
    if (key == "cf") found.function = std::string(trimmed(value));
    if (key == "cf") has_function = true;
    if (key == "c0") found.c0 = foreign_number(value);
    if (key == "c1") found.c1 = foreign_number(value);
    // The name that ImageJ gives to numbers without a unit.
    if (key == "vunit" && lower_case(value) != "gray value") found.unit = value;
  }
  constexpr const char* none = "20";
  if (!has_function || found.function == none) return std::nullopt;
  return found;
}

namespace {

/// Why a straight line cannot be drawn; "" if it can.
std::string doubt_of_line(const ImageJCalibration& calibration) {
  constexpr const char* kept = "; numbers are kept as they are";
  for (const auto& [name, number] : {std::pair("c0", &calibration.c0), {"c1", &calibration.c1}}) {
    if (number->is_absent()) return fmt::format("ImageJ's calibration has no coefficient {}{}", name, kept);
    if (number->is_unreadable())
      return fmt::format("ImageJ's calibration has the coefficient {} = {}, which is not a number{}", name,
                         quoted(number->text), kept);
  }
  if (calibration.c1.value == 0)
    return fmt::format("ImageJ's calibration has the coefficients {} and {}{}", calibration.c0.text,
                       calibration.c1.text, kept);
  return "";
}

}  // namespace

CalibratedSamples calibrated(const ImageJCalibration& calibration, SampleType type) {
  CalibratedSamples samples;
  samples.type = type;
  // ImageJ calibrates no other numbers.
  if (type != SampleType::uint8 && type != SampleType::uint16 && type != SampleType::int16) return samples;
  const auto function = whole_number_of(calibration.function);
  if (!function) {
    samples.scale_doubt =
        fmt::format("the function of ImageJ's calibration is {}; numbers are kept as they are",
                    quoted(calibration.function));
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

}  // namespace tagrid
