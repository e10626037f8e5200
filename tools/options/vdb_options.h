// Options for OpenVDB files.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "io/formats/table/formats.h"
#include "tools/options/shared_options.h"

namespace tagrid {

/// How a volume becomes a grid. See tools/formats/vdb/writer/vdb_output.cpp for what is not given.
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

/// Reports how large errors can be if a tolerance has added to them. `facts` is what the program said of the
/// grid.
void tell_of_tolerance(const RunOptions& run, const std::string& output, const nlohmann::ordered_json& facts);

}  // namespace tagrid
