// Largest errors that follow from the samples, as plain numbers.
#pragma once

#include <string>

#include "io/volume/volume_source.h"
#include "pipeline/encode/options.h"

namespace tagrid {

struct PlainBound {
  EncodeOptions options;  ///< without an error_rule
  std::string reason;     ///< how the bound follows from the samples; "" if there was no rule
};

/// Replaces the rule of the options, if there is one, by the largest error that it gives for this volume, whole for
/// integers. Reads the volume and rewinds it: a sample of it for the noise, all of it for its range, and for a PSNR all
/// of it two or three times, which are coded on `threads` threads. Throws UsageError if the volume cannot be read like
/// that, or if the bound cannot be combined with the other options.
PlainBound with_plain_bound(const EncodeOptions& options, VolumeSource& source, int threads);

}  // namespace tagrid
