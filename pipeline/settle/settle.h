// From a request to a job: everything is decided here that must be known before the first brick is encoded.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "io/volume/volume_source.h"
#include "pipeline/job/job.h"
#include "pipeline/job/options.h"
#include "pipeline/job/resolved_options.h"
#include "pipeline/memory/plan.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

/// What was found out earlier about the same samples, which need not be read for that again.
struct EarlierFindings {
  std::optional<double> max_error = {};
  double transform_step = 0;
  FilterWeights filter{};
  std::string reason_of_bound = {};
  std::optional<std::pair<double, double>> range = {};
};

/// What a job is settled for, besides the options.
struct Settling {
  Resources resources;     ///< of this process
  bool any_rows = true;    ///< the encoder can read rows of slices in any order
  bool encodes = true;     ///< false: the job is for a comparison; nothing is summed for overviews
  EncodeNeeds needs = {};  ///< besides bricks; whether blocks are summed follows from the options
  EarlierFindings earlier = {};
  Progress searching = {};  ///< told of each try of a bound
  TellOfCopy before_copy =
      {};  ///< called before the samples are copied, because they are read more than once
};

/// How a source must be readable before it is encoded.
enum class Look {
  once,            ///< not at all, or by what the source allows
  again,           ///< from front to back, and then once more
  a_few_rows,      ///< some rows, from front to back
  all_rows_often,  ///< rows of bricks, many times
};

/// How settle() reads the samples.
Look look_of(const ResolvedOptions& options, const EarlierFindings& earlier);

/// The plan with which settle() begins. Throws MemoryLimit.
EncodePlan plan_of(const ResolvedOptions& options, const Settling& settling);

/// The first step of settle(): what follows from the options alone. Throws MemoryLimit.
EncodeJob planned(const ResolvedOptions& options, const Settling& settling);

/// The second step: what follows from the samples. `job` is that of the first.
void find_in_samples(EncodeJob& job, const ResolvedOptions& options, VolumeSource& volume,
                     const Settling& settling);

/// Settles the job of encoding a volume. Reads the samples as far as the options need it, and rewinds the volume.
/// Throws UsageError if the volume does not allow the options, and MemoryLimit before a sample is read. REQUIRES: the
/// volume can be read as look_of() says; any other is for settle_any() in read_again.h.
EncodeJob settle(const EncodeOptions& options, VolumeSource& volume, const Settling& settling);

/// The same for samples that cannot be read beforehand. Throws UsageError if the options need that.
EncodeJob settle(const EncodeOptions& options, const SourceFacts& volume, const Settling& settling);

/// The parameters, with the range of the samples if they follow from it. Reads the volume then, and rewinds it.
CodingParameters with_range_of(const ResolvedOptions& options, VolumeSource& volume);

}  // namespace tagrid
