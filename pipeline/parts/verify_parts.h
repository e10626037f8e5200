// A .tag file put to the test by several processes.
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
  Resources resources{0};  ///< of each rank; 0 threads: as many as it may run on
};

/// Collective. Verifies the parts; rank 0 gets what the index says of the whole verified as well. `verifier`
/// is that of this rank, where it has one already.
VerifyResult verify_parts(Ranks& ranks, const VerifyOrder& order,
                          std::unique_ptr<Verifier> verifier = nullptr, const Progress& progress = {});

}  // namespace tagrid
