// All settings that affect the output, as text, so that a resumed run can be compared with the original one.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/volume/volume_info.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// Names of the settings, and their values.
std::vector<std::pair<std::string, std::string>> settings_of(const CodingParameters& parameters,
                                                             const SourceDescription& source);

}  // namespace tagrid
