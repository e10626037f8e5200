// Verifies a .tag file with several processes.
#pragma once

#include <optional>
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

/// Collective. Verifies the parts. Rank 0 also verifies the index's totals for the entire file. `setup` is
/// that of this rank, if it has it already.
VerifyResult verify_parts(Ranks& ranks, const VerifyOrder& order, std::optional<VerifySetup> setup = {},
                          const Progress& progress = {});

}  // namespace tagrid
