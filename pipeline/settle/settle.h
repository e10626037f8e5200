// From options to a job: everything is decided here that must be known before the first brick is encoded.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/tag/header.h"
#include "io/volume/volume_source.h"
#include "pipeline/job/read_again.h"
#include "pipeline/job/resolved_options.h"
#include "pipeline/memory/plan.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

/// What an encoding will do, in one process or many, from a file or from slices that a caller gives.
struct EncodeJob {
  TagHeader header;  ///< of the file
  EncodePlan plan = {};
  std::vector<int> overviews = {};   ///< their factors
  std::string reason_of_bound = {};  ///< how the largest error follows from the options; "" if it was given
  std::string doubt_of_bound = {};   ///< why it may not be what is wanted; "" if nothing says that
  double times_read = 0;             ///< how often a sample was read to find that out

  const CodingParameters& parameters() const { return header.parameters; }
};

/// What was found out earlier about the same samples, which need not be read for that again.
struct EarlierFindings {
  std::optional<double> max_error = {};
  double transform_step = 0;
  std::string reason_of_bound = {};
  std::optional<std::pair<double, double>> range = {};
};

/// How settle() reads the samples.
Look look_of(const ResolvedOptions& options, const EarlierFindings& earlier = {});

/// Reads the samples as far as the options need it, and rewinds the volume. `searching` is told of each try
/// of a bound. Throws UsageError if the volume does not allow the result. REQUIRES: `source` can be read as look_of()
/// says.
EncodeJob settle(const ResolvedOptions& options, const EncodePlan& plan, VolumeSource& source,
                 const Progress& searching = {}, const EarlierFindings& earlier = {});

/// The same for samples that cannot be read beforehand. Throws UsageError if the options need that.
EncodeJob settle(const ResolvedOptions& options, const EncodePlan& plan);

}  // namespace tagrid
