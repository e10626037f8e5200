// Verifies a .tag file with several processes.
#pragma once

#include <memory>
#include <string>

#include "pipeline/parts/part_work.h"
#include "pipeline/ranks/ranks.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {

struct VerifyOrder {
  std::string input, original;
  SourceDescription source;
  Resources resources{0};  ///< per rank; 0 threads: all that the rank may use
};

/// Collective. Verifies the parts. Rank 0 also verifies the index's totals for the whole file. `verifier` is
/// the one that this rank has already opened, if any.
VerifyResult verify_parts(Ranks& ranks, const VerifyOrder& order,
                          std::unique_ptr<Verifier> verifier = nullptr, const Progress& progress = {});

}  // namespace tagrid
