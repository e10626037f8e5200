// --region: a box of samples.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "pipeline/decode/decode_run.h"

namespace tagrid {

/// Adds --region. `description`: what the command does with the samples.
void add_region_option(CLI::App& command, std::string& region, const std::string& description);

/// The region that the option names; the entire volume if it was not given (""). Throws UsageError.
WantedRegion wanted_region(const std::string& region);

}  // namespace tagrid
