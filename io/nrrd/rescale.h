// The meaning of samples, as key-value pairs of NRRD header lines give it.
#pragma once

#include <string_view>

#include "io/volume/volume_info.h"

namespace tagrid {

/// The slope, intercept and units of the values: those that add_rescale() wrote. If there are none, if they are not finite
/// numbers, or if each slice has its own, values are the samples. Throws BrokenInput if a line is not one of a header.
Rescale rescale_of(std::string_view nrrd_fields);

/// The largest error of samples that is at most `error` in values.
double error_in_samples(double error, const Rescale& rescale);

}  // namespace tagrid
