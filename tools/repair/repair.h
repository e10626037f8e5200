// Rebuilds a damaged .tag file from its parity, and proves that it is intact again.
#pragma once

#include <string>

#include "pipeline/ranks/ranks.h"
#include "tools/options/shared_options.h"
#include "tools/repair/survey.h"

namespace tagrid {

/// Writes the file `input`, as it was protected, to `output`, which may be the same path: it gets its name once all its
/// checksums agree. `parity` is that of `input`. Returns false if only its parity could be checked, because it is of a
/// newer version. Throws BrokenInput if the parity is of another file, and WorldError. REQUIRES:
/// parity.condition.is_repairable().
bool repair_file(const SurveyedParity& parity, const std::string& input, const std::string& output,
                 bool overwrite, const RunOptions& run, const Ranks& ranks);

}  // namespace tagrid
