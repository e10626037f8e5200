// Rebuilds a damaged .tag file from its parity, and proves that it is intact again.
#pragma once

#include <string>

#include "io/files/file_attributes.h"
#include "pipeline/ranks/ranks.h"
#include "tools/options/shared_options.h"
#include "tools/repair/survey.h"

namespace tagrid {

/// Writes the file `input`, as it was protected, to `output`, which may be the same path: it gets its name once all its
/// checksums agree, if `watched`, which began before `parity` was surveyed, shows that the file is still the same. Returns false if only its parity could be checked, because it is of a
/// newer version. Throws BrokenInput if the parity is of another file, and WorldError. REQUIRES:
/// parity.condition.is_repairable().
bool repair_file(const SurveyedParity& parity, const UnchangedFiles& watched, const std::string& input,
                 const std::string& output, bool overwrite, const RunOptions& run, const Ranks& ranks);

}  // namespace tagrid
