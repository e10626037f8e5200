// The commands. Each one adds itself to the command line, and does its work if it was given.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

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
Action add_archive_list_command(CLI::App& app);
Action add_archive_find_command(CLI::App& app);
Action add_archive_check_command(CLI::App& app);
Action add_archive_repair_command(CLI::App& app);
Action add_archive_restore_command(CLI::App& app);
Action add_archive_export_command(CLI::App& app);
Action add_archive_forget_command(CLI::App& app);
Action add_archive_move_command(CLI::App& app);

/// Sets up the command line: `app` with its help, and all commands in the order of the help. `version` is what
/// --version prints. Returns each command with its work.
std::vector<std::pair<CLI::App*, Action>> add_commands(CLI::App& app, const std::string& version);

/// An example at the end of the help of a command: what somebody may want, and the command line that does it.
struct Example {
  const char *wish, *line;
};
/// The examples of the command with this name; those of the program itself for "".
std::array<Example, 2> examples_of(const std::string& command);

/// Restores the source files of a .tag file into a directory. Throws as restore_files() does.
void restore_files_of(const std::string& input, const std::string& folder, bool overwrite,
                      const RunOptions& run, Ranks& ranks);

/// How a volume leaves an archive.
struct ExportedVolume {
  std::string input, output, format, region;
  std::int64_t step = 1, overview = 0;
  bool values = false, overwrite = false;
};
/// Decodes a .tag file, as `tagrid decode` does with these options.
void decode_as(const ExportedVolume& volume, const RunOptions& run, Ranks& ranks);

/// Writes the source files of a .tag file, which are DICOM, as images of their own into the new directory `folder`.
/// Throws UsageError, BrokenInput and WorldError.
void export_as_dicom(const std::string& input, const std::string& folder, bool overwrite,
                     const RunOptions& run, const Ranks& ranks);

/// Throws UsageError for pipes and devices, which cannot be read in any order. `what` the file is: "the file to
/// repair".
void require_input_file(const std::string& path, const char* what);

}  // namespace tagrid
