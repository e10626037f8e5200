// Options of outputs: their name and format, the region that they hold, and what only OpenVDB files have.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "io/formats/table/formats.h"
#include "pipeline/decode/decode_run.h"
#include "tools/options/shared_options.h"

namespace tagrid {

struct OutputOptions {
  std::string path;
  bool overwrite = false;
};

/// -o, -f
void add_output_options(CLI::App& command, OutputOptions& options);

/// `input` with `ending` instead of its own ending; "-" for "-".
std::string output_beside(const std::string& input, const std::string& ending);

/// Throws UsageError if `output` is the standard output and that is a terminal. `what` is binary.
void refuse_terminal(const Ranks& ranks, const std::string& output, const char* what);

/// --format. `other`: the name of a format of this command alone, which its own help explains.
void add_format_option(CLI::App& command, std::string& format, const std::string& other = "");

/// The format that --format names; if it was not given (""), the format that the name of the output implies.
/// Throws UsageError if a file's name implies a different format.
const Format& volume_format_option(const std::string& format, const std::string& output);

/// Adds --region.
void add_region_option(CLI::App& command, std::string& region);

/// Adds --volume.
void add_volume_option(CLI::App& command, std::optional<std::int64_t>& volume);
/// The volume of `input` that a command uses: the first one by default, which is said if there are others.
/// Throws UsageError if the file does not have it, or if one is given for a pipe.
std::int64_t chosen_volume(const std::string& input, const std::optional<std::int64_t>& volume,
                           const RunOptions& run);

/// The region that the option names; the entire volume if it was not given (""). Throws UsageError.
WantedRegion wanted_region(const std::string& region);

/// How a volume becomes an OpenVDB grid. See io/formats/vdb/writer/program.cpp for what is not given.
struct VdbOptions {
  std::string grid;
  std::string type;  ///< "float" or "int32"
  std::optional<double> background;
  double tolerance = 0;  ///< Samples at most this far from the background become the background.
};

/// --vdb-grid, --vdb-type, --vdb-background, --vdb-tolerance of an output
void add_vdb_output_options(CLI::App& command, VdbOptions& options);

/// Throws UsageError if they were given for another format, or are invalid.
void check_vdb_options(const VdbOptions& options, const Format& format);

/// The same, as the program that writes grids gets them.
std::map<std::string, std::string> wishes_of(const VdbOptions& options);

/// Reports how large errors can be with a tolerance. `facts` is what the program reported of the grid.
void tell_of_tolerance(const RunOptions& run, const std::string& output, const nlohmann::ordered_json& facts);

}  // namespace tagrid
