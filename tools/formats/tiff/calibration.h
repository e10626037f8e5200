// What ImageJ says that numbers mean.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "io/text/foreign_number.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// Analyze > Calibrate: a value is a function of a number of at least 0.
struct ImageJCalibration {
  std::string function;  ///< its number as it is written; "0": c0 + c1 * number
  ForeignNumber c0, c1;
  std::string unit;  ///< of values; "" if none is given

  bool operator==(const ImageJCalibration& other) const {
    return function == other.function && c0.text == other.c0.text && c1.text == other.c1.text &&
           unit == other.unit;
  }
};

/// Nothing if the description of an image is not ImageJ's, or has no calibration.
std::optional<ImageJCalibration> calibration_of(std::string_view description);

/// The effect of a calibration on samples.
struct CalibratedSamples {
  SampleType type = SampleType::uint8;
  std::int32_t add = 0;  ///< to each integer
  Rescale rescale;
  std::string warning;         ///< of a coefficient that is written in an unusual way; "" if none is
  std::string not_understood;  ///< what the calibration is, if it has no effect; "" if it has
  std::string scale_doubt;     ///< what of it cannot be read; "" if all can
};

/// Signed numbers, which ImageJ keeps as unsigned ones with c0 = -32768, become signed samples. Other
/// straight lines are a slope and an intercept.
CalibratedSamples calibrated(const ImageJCalibration& calibration, SampleType type);

}  // namespace tagrid
