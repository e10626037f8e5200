// The commands. Each one adds itself to the command line, and does its work if it was given.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/parity/parity.h"
#include "pipeline/ranks/ranks.h"
#include "tools/options/shared_options.h"

namespace tagrid {

/// The work of a command after the command line was parsed. Only rank 0 calls it.
using Action = std::function<void(Ranks&)>;

/// Adds one command to `app`. The returned action is to be called if the command was given.
Action add_encode_command(CLI::App& app);
Action add_decode_command(CLI::App& app);
Action add_info_command(CLI::App& app);
Action add_verify_command(CLI::App& app);
Action add_restore_command(CLI::App& app);
Action add_mesh_command(CLI::App& app);
Action add_surface_command(CLI::App& app);
Action add_preview_command(CLI::App& app);
Action add_view_command(CLI::App& app);
Action add_serve_command(CLI::App& app);
Action add_convert_command(CLI::App& app);
Action add_estimate_command(CLI::App& app);
Action add_formats_command(CLI::App& app);
Action add_phantom_command(CLI::App& app);
Action add_repair_command(CLI::App& app);
Action add_protect_command(CLI::App& app);

/// Sets up the command line: `app` with its help, and all commands in the order of the help. `version` is what
/// --version prints. Returns each command with its work.
std::vector<std::pair<CLI::App*, Action>> add_commands(CLI::App& app, const std::string& version);

/// An example at the end of the help of a command: what somebody may want, and the command line that does it.
struct Example {
  const char *wish, *line;
};
/// The examples of the command with this name; those of the program itself for "".
std::array<Example, 2> examples_of(const std::string& command);

/// A file with parity, and what is damaged of both.
struct SurveyedParity {
  ProtectedFile file;
  ParityCondition condition;
};
/// Looks at the parity of a file: that which helps, if it has parity in it and beside it. Nothing if there is none.
/// `work` is for an error of the limit on memory. Throws WorldError and MemoryLimit.
std::optional<SurveyedParity> survey_parity(const std::string& path, const RunOptions& run,
                                            const std::string& work);

/// Throws UsageError for pipes and devices, which cannot be read in any order. `what` the file is: "the file to
/// repair".
void require_input_file(const std::string& path, const char* what);

/// True if nearly nothing of a file is what parity beside it protects.
bool is_of_another_file(const SurveyedParity& parity);
/// What of a file with parity is damaged: "3 damaged blocks". REQUIRES: something is.
std::string damage_text(const ParityCondition& condition);
/// REQUIRES: !parity.condition.is_repairable().
std::string why_not_repairable(const SurveyedParity& parity, const std::string& path);

}  // namespace tagrid
