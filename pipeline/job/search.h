// The bound or the step of a transform that follows from what a file is to be: found by trial encodings.
#pragma once

#include <string>

#include "io/volume/volume_source.h"
#include "pipeline/job/resolved_options.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

struct FoundBound {
  double max_error = 0;    ///< of samples; an integer if they are integers
  std::string reason;      ///< how it follows from the samples
  std::string doubt = {};  ///< why it may not be what is wanted; "" if nothing says that
  double step = 0;         ///< of a transform; 0: none
};

/// What takes the fewest bits and reaches a PSNR, in dB. A sample of the volume is coded some ten times, and all of it
/// three times or a few more. The arena is the caller's. REQUIRES: source.traits().any_rows.
FoundBound bound_of_psnr(const ResolvedOptions& options, VolumeSource& source, double psnr,
                         const Progress& progress);

/// What has the largest PSNR in so many bits a sample. They include header, index and overviews, but not parity and
/// the envelope. Otherwise as above. Throws UsageError if that is too little for any file.
FoundBound bound_of_size(const ResolvedOptions& options, VolumeSource& source, double bits,
                         const Progress& progress);

}  // namespace tagrid
