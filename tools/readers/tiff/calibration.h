// What ImageJ says that numbers mean.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "io/volume/volume_info.h"

namespace tagrid {

/// Analyze > Calibrate: a value is a function of a number from 0 on.
struct ImageJCalibration {
  int function = 0;  ///< 0: c0 + c1 * number
  double c0 = 0, c1 = 1;
  std::string unit;  ///< of values; "" if none is given

  bool operator==(const ImageJCalibration&) const = default;
};

/// Nothing if the description of an image is not ImageJ's, or has no calibration.
std::optional<ImageJCalibration> calibration_of(std::string_view description);

/// What a calibration makes of samples.
struct CalibratedSamples {
  SampleType type;
  std::int32_t add = 0;  ///< to each integer
  Rescale rescale;
  std::string warning;  ///< why the calibration has no effect; "" if it has
};

/// Signed numbers, which ImageJ keeps as unsigned ones with c0 = -32768, become signed samples. Other straight lines
/// are a slope and an intercept.
CalibratedSamples calibrated(const ImageJCalibration& calibration, SampleType type);

}  // namespace tagrid
