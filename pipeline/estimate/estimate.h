// Estimates of encodings of a volume, from a sample of its bricks.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "io/volume/volume_source.h"
#include "pipeline/job/options.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "pipeline/settle/read_again.h"

namespace tagrid {

struct EstimateRun {
  std::string input;
  SourceDescription source = {};
  EncodeOptions options = {};           ///< max_error is not used
  std::vector<double> max_errors = {};  ///< if there are none, and no rules: a list that fits the noise
  std::vector<ErrorRule> rules = {};    ///< also tried, after them: PSNRs and sizes
  Resources resources{1};
  Progress progress = {};
  TellOfCopy before_copy = {};  ///< called before the samples of a pipe or a compressed file are copied
};

struct Estimate {
  std::optional<ErrorRule> rule = {};  ///< that was asked for; none for a bound
  double max_error = 0;                ///< as `encode` keeps it; negative: none
  double asked_error = 0;              ///< of which that is the bound; the same if no bounds were given
  double transform_step = 0;           ///< of the samples; 0: none
  double file_bytes = 0;
  double rmse = 0;
  double psnr = 0;  ///< in dB, with max - min of the samples as peak; NaN if nothing is lost
  double encoding_seconds = 0, decoding_seconds = 0;  ///< with the threads of the run, without I/O
  double search_seconds = 0;  ///< that `encode` takes besides, to find what the rule needs
};

struct EstimateResult {
  CodingParameters parameters;  ///< of all the encodings, except for bounds
  double noise = 0;             ///< see noise_of()
  std::string doubt_of_noise;   ///< "" if nothing says that the noise is wrong
  double low = 0, high = 0;     ///< of the samples that were looked at
  int threads = 1;              ///< that fit into the limit on memory
  std::int64_t bricks = 0, encoded = 0;
  std::vector<Estimate> estimates;       ///< in the order of max_errors, then of rules that can be kept
  std::vector<UsageError> out_of_reach;  ///< why other rules cannot be kept
};

/// Encodes and decodes a sample of the bricks, or all of a small volume, with every bound. Infers the rest
/// from roughness. Throws UsageError, also if there is no estimate at all, BrokenInput, WorldError and MemoryLimit.
EstimateResult estimate_encoding(const EstimateRun& run);

/// The most memory of estimating: `bounds` are tried on `chosen` bricks; all bricks are looked at.
std::uint64_t memory_of_estimating(const CodingParameters& parameters, std::int64_t threads,
                                   std::int64_t bounds, std::int64_t chosen);

}  // namespace tagrid
