#include "tools/readers/tiff/calibration.h"

#include <fmt/format.h>

#include <cmath>

#include "io/files/text.h"

namespace tagrid {

std::optional<ImageJCalibration> calibration_of(std::string_view description) {
  if (!description.starts_with("ImageJ=")) return std::nullopt;
  std::optional<std::int64_t> function;
  ImageJCalibration found;
  while (!description.empty()) {
    const std::string_view line = take_line(description);
    const std::size_t equal = line.find('=');
    if (equal == line.npos) continue;
    const std::string_view key = line.substr(0, equal), value = line.substr(equal + 1);
    if (key == "cf") function = whole_number_of(value);
    if (key == "c0") found.c0 = number_of(value).value_or(std::nan(""));
    if (key == "c1") found.c1 = number_of(value).value_or(std::nan(""));
    // The name that ImageJ gives to numbers without a unit.
    if (key == "vunit" && lower_case(value) != "gray value") found.unit = value;
  }
  constexpr std::int64_t none = 20;
  if (!function || *function == none) return std::nullopt;
  found.function = *function >= 0 && *function < none ? static_cast<int>(*function) : -1;
  return found;
}

CalibratedSamples calibrated(const ImageJCalibration& calibration, SampleType type) {
  CalibratedSamples samples{.type = type, .add = 0, .rescale = {}, .warning = ""};
  // ImageJ calibrates no other numbers.
  if (type != SampleType::uint8 && type != SampleType::uint16 && type != SampleType::int16) return samples;
  const auto& [function, c0, c1, unit] = calibration;
  if (function != 0 || !std::isfinite(c0) || !std::isfinite(c1) || c1 == 0) {
    samples.warning = function == 0
                          ? fmt::format("ImageJ's calibration has the coefficients {} and {}", c0, c1)
                          : std::string("ImageJ's calibration is not a straight line");
    samples.warning += "; numbers are kept as they are";
    return samples;
  }
  constexpr double half = 32768;
  samples.rescale.units = unit;
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
