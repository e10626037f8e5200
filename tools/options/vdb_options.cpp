#include "tools/options/vdb_options.h"

#include <fmt/format.h>

#include "io/errors/errors.h"
#include "tools/report/process.h"

namespace tagrid {

void add_vdb_output_options(CLI::App& command, VdbOptions& options) {
  const char* group = "OpenVDB output";
  command
      .add_option("--vdb-grid", options.grid,
                  "Name of the grid (default: its name before encoding, or density)")
      ->option_text("NAME")
      ->group(group);
  command
      .add_option("--vdb-type", options.type,
                  "Grid type for 8- and 16-bit samples (default: float, which most programs read)")
      ->check(one_of({"float", "int32"}))
      ->option_text("float|int32")
      ->group(group);
  add_number_option(command, "--vdb-background", options.background,
                    "Value of inactive voxels (default: the background before encoding, or the first voxel)")
      ->option_text("V")
      ->group(group);
  add_number_option(command, "--vdb-tolerance", options.tolerance,
                    "Turn voxels within T of the background into background (default: 0)")
      ->option_text("T")
      ->group(group);
}

void check_vdb_options(const VdbOptions& options, const Format& format) {
  if (!(options.tolerance >= 0))
    throw UsageError(fmt::format("--vdb-tolerance {}: must not be negative", options.tolerance));
  if (format.has_grids) return;
  if (!options.grid.empty() || !options.type.empty() || options.background || options.tolerance > 0)
    throw UsageError(
        "--vdb-grid, --vdb-type, --vdb-background and --vdb-tolerance are for OpenVDB files; give -o "
        "FILE.vdb");
}

std::map<std::string, std::string> wishes_of(const VdbOptions& options) {
  std::map<std::string, std::string> wishes;
  if (!options.grid.empty()) wishes["grid"] = options.grid;
  if (!options.type.empty()) wishes["type"] = options.type;
  if (options.background) wishes["background"] = fmt::format("{}", *options.background);
  if (options.tolerance > 0) wishes["tolerance"] = fmt::format("{}", options.tolerance);
  return wishes;
}

void tell_of_tolerance(const RunOptions& run, const std::string& output,
                       const nlohmann::ordered_json& facts) {
  // A program said this, so it may be anything.
  const auto number = [&](const char* key) {
    const auto found = facts.find(key);
    return found != facts.end() && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
  };
  const double tolerance = number("tolerance").value_or(0);
  if (tolerance == 0 || run.quiet) return;
  std::string bound;
  if (const auto error = number("max_error"))
    bound = fmt::format("; every voxel is within {} of the original, {} + {}", *error, *error - tolerance,
                        tolerance);
  say_line(fmt::format("tagrid: {}: voxels within {} of the background, {}, became the background{}", output,
                       tolerance, number("background").value_or(0), bound));
}

}  // namespace tagrid
