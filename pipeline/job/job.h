// A job: all that must be known before the first brick of a volume is encoded.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "io/tag/header.h"
#include "pipeline/memory/plan.h"
#include "stages/sample/filter_fit.h"

namespace tagrid {

/// What an encoding will do, in one process or many, from a file or from slices that a caller gives.
struct EncodeJob {
  TagHeader header;  ///< of the file
  EncodePlan plan = {};
  std::vector<int> overviews = {};   ///< their factors
  std::string reason_of_bound = {};  ///< how the largest error follows from the options; "" if it was given
  std::string doubt_of_bound = {};   ///< why it may not be what is wanted; "" if nothing says that
  double times_read = 0;             ///< how often a sample was read to find that out
  std::uint64_t memory = 0;          ///< the most that this took, or that the plan allows
  FilterSums* filter_sums =
      nullptr;  ///< of a trial: the errors of transformed bricks are added; nullptr: nowhere

  const CodingParameters& parameters() const { return header.parameters; }
};

/// A temporary copy of samples that is about to be made. It has no name, and so is gone with this process.
struct SampleCopy {
  std::string volume;  ///< what the user calls it
  std::string folder;
  std::uint64_t bytes = 0;
};
using TellOfCopy = std::function<void(const SampleCopy& copy)>;

}  // namespace tagrid
