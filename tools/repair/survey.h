// What parity can do for a file that may be damaged.
#pragma once

#include <optional>
#include <string>

#include "io/parity/parity.h"
#include "tools/options/shared_options.h"

namespace tagrid {

/// A file with parity, and what is damaged of both.
struct SurveyedParity {
  ProtectedFile file;
  ParityCondition condition;
};
/// Looks at the parity of a file: that which helps, if it has parity in it and beside it. Nothing if there is none.
/// `work` is for an error of the limit on memory. Throws WorldError and MemoryLimit.
std::optional<SurveyedParity> survey_parity(const std::string& path, const RunOptions& run,
                                            const std::string& work);

/// True if nearly nothing of a file is what parity beside it protects.
bool is_of_another_file(const SurveyedParity& parity);
/// What of a file with parity is damaged: "3 damaged blocks". REQUIRES: something is.
std::string damage_text(const ParityCondition& condition);
/// REQUIRES: !parity.condition.is_repairable().
std::string why_not_repairable(const SurveyedParity& parity, const std::string& path);

}  // namespace tagrid
