// The bound or the step of a transform that follows from what a file is to be: found by trial encodings.
#pragma once

#include <string>

#include "io/volume/volume_source.h"
#include "pipeline/job/resolved_options.h"
#include "pipeline/memory/plan.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

struct FoundBound {
  double max_error = 0;    ///< of samples; an integer if they are integers
  std::string reason;      ///< how it follows from the samples
  std::string doubt = {};  ///< why it may not be what is wanted; "" if nothing says that
  double step = 0;         ///< of a transform; 0: none
  double times_read = 0;   ///< how often a sample was read to find it, on average
  /// Of the voxels that were tried last, if only a sample of them was: in dB, and of samples; 0 if nothing is lost.
  double psnr = 0, rmse = 0;
  FilterWeights filter{};  ///< after the transform
};

/// True for volumes of which a sample is tried first.
bool is_sampled(const Index3& dims);

/// The bound of a rule that is tried:
/// - for a PSNR, in dB, what takes the fewest bits and reaches it;
/// - for a size, what has the largest PSNR in it. A size includes header, index and overviews, but not parity and the
///   envelope. Throws UsageError if that is too little for any file.
/// With a transform, a filter is fitted to a sample, and used if it saves more bytes than its weights take.
/// A sample of the volume is coded some ten times and, unless `sampled`, all of it three times or a few more; then the
/// source is rewound. `plan`: for bricks of the parameters of `options`. REQUIRES:
/// options.options.error_rule->is_tried(), source.traits().any_rows.
FoundBound bound_by_trials(const ResolvedOptions& options, const EncodePlan& plan, VolumeSource& source,
                           bool sampled, const Progress& progress);

}  // namespace tagrid
