#include "tools/options/vdb_options.h"

#include <fmt/format.h>

#include "io/files/errors.h"
#include "tools/report/process.h"

namespace tagrid {

void add_vdb_output_options(CLI::App& command, VdbOptions& options) {
  const char* group = "OpenVDB output";
  command.add_option("--vdb-grid", options.grid, "Name of the grid; default: the name it had, or density")
      ->option_text("NAME")
      ->group(group);
  add_number_option(
      command, "--vdb-background", options.background,
      "Value of inactive voxels; default: the background it had, or the value of the first voxel")
      ->option_text("V")
      ->group(group);
  add_number_option(command, "--vdb-tolerance", options.tolerance,
                    "Voxels within T of the background become the background (0)")
      ->option_text("T")
      ->group(group);
}

void check_vdb_options(const VdbOptions& options, const Format& format) {
  if (!(options.tolerance >= 0))
    throw UsageError(fmt::format("--vdb-tolerance {}: must not be negative", options.tolerance));
  if (format.has_grids) return;
  if (!options.grid.empty() || options.background || options.tolerance > 0)
    throw UsageError(
        "--vdb-grid, --vdb-background and --vdb-tolerance are for OpenVDB files; give -o FILE.vdb");
}

nlohmann::ordered_json vdb_json(const VdbSummary& summary) {
  nlohmann::ordered_json json;
  json["grid"] = summary.grid;
  json["background"] = summary.background;
  json["tolerance"] = summary.tolerance;
  json["max_error"] =
      summary.max_error ? nlohmann::ordered_json(*summary.max_error) : nlohmann::ordered_json(nullptr);
  json["active_voxels"] = summary.active_voxels;
  json["leaves"] = summary.leaves;
  return json;
}

void tell_of_tolerance(const RunOptions& run, const std::string& output, const VdbSummary& summary) {
  if (summary.tolerance == 0 || run.quiet) return;
  const std::string bound =
      summary.max_error
          ? fmt::format("; every voxel is within {} of the original, {} + {}", *summary.max_error,
                        *summary.max_error - summary.tolerance, summary.tolerance)
          : "";
  say_line(fmt::format("tagrid: {}: voxels within {} of the background, {}, became the background{}", output,
                       summary.tolerance, summary.background, bound));
}

}  // namespace tagrid
