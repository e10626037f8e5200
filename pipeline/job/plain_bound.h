// Largest errors that follow from the samples, as plain numbers.
#pragma once

#include <string>

#include "io/volume/volume_source.h"
#include "pipeline/job/options.h"
#include "pipeline/memory/progress.h"

namespace tagrid {

struct PlainBound {
  EncodeOptions options;  ///< without an error_rule
  std::string reason;     ///< how the bound follows from the samples; "" if there was no rule
};

/// Replaces the rule of the options, if there is one, by the largest error that it gives for this volume, whole for
/// integers. Reads the volume and rewinds it: a sample of it for the noise, all of it for its range. For a PSNR
/// a sample is coded some ten times, and all of it three times or a few more, on `threads` threads: the next larger bound,
/// by one or by half a per cent, does not reach it. `progress` is told how far each of these tries has come. Throws UsageError if the volume cannot be read like
/// that, or if the bound cannot be combined with the other options.
PlainBound with_plain_bound(const EncodeOptions& options, VolumeSource& source, int threads,
                            const Progress& progress = {});

}  // namespace tagrid
