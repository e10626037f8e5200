// Options for OpenVDB files.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "io/formats/formats.h"
#include "io/vdb/writer.h"
#include "tools/options/shared_options.h"

namespace tagrid {

/// --vdb-grid, --vdb-background, --vdb-tolerance of an output
void add_vdb_output_options(CLI::App& command, VdbOptions& options);

/// Throws UsageError if they were given for another format, or make no sense.
void check_vdb_options(const VdbOptions& options, const Format& format);

/// Statistics of the written grid, for scripts.
nlohmann::ordered_json vdb_json(const VdbSummary& summary);

/// Tells how large errors can be if a tolerance has added to them.
void tell_of_tolerance(const RunOptions& run, const std::string& output, const VdbSummary& summary);

}  // namespace tagrid
