// The subcommands. Each adds itself to the command line and does its work when it was given.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>

#include "pipeline/ranks/ranks.h"

namespace tagrid {

/// What a subcommand does once the command line was parsed; by rank 0.
using Action = std::function<void(Ranks&)>;

/// Adds one subcommand to `app`. The returned action is run if the subcommand was given.
Action add_encode_command(CLI::App& app);
Action add_decode_command(CLI::App& app);
Action add_info_command(CLI::App& app);
Action add_verify_command(CLI::App& app);
Action add_mesh_command(CLI::App& app);
Action add_convert_command(CLI::App& app);
Action add_phantom_command(CLI::App& app);

}  // namespace tagrid
