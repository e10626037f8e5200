// Everything that decides on what a run makes, in words: to be compared with what it was begun with.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/volume/volume_info.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {

/// Options and their values, as the command line has them.
std::vector<std::pair<std::string, std::string>> settings_of(const CodingParameters& parameters,
                                                             const SourceDescription& source);

}  // namespace tagrid
