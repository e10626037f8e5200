// Maximum errors that follow from the samples, as plain numbers.
#pragma once

#include <string>

#include "io/volume/volume_source.h"
#include "pipeline/job/resolved_options.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

struct FoundBound {
  double max_error = 0;  ///< of samples; an integer if they are integers
  std::string reason;    ///< how it follows from the samples
};

/// The largest error that the rule of the options gives for this volume. Reads the volume and rewinds it: a
/// sample of it for the noise, all of it for its range. For a PSNR a sample is coded some ten times, and all of
/// it three times or a few more, on `threads` threads: the next larger bound, by one or by half a per cent, does
/// not reach it. `progress` is told how far each of these tries has come. Throws UsageError if the volume cannot
/// be read like that, or if the bound cannot be combined with the other options. REQUIRES: there is a rule.
FoundBound bound_of_rule(const ResolvedOptions& options, VolumeSource& source, int threads,
                         const Progress& progress = {});

}  // namespace tagrid
