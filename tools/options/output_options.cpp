#include "tools/options/output_options.h"

#include <fmt/format.h>

#include <filesystem>
#include <tuple>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/open_source.h"
#include "io/system/this_process.h"
#include "io/tag/bricks.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "tools/report/process.h"

namespace tagrid {

void add_output_options(CLI::App& command, OutputOptions& options) {
  add_text_option(command, "-o,--output", options.path, "FILE", "Output file, or - for standard output");
  command.add_flag("-f,--force", options.overwrite, "Overwrite files that exist");
}

std::string output_beside(const std::string& input, const std::string& ending) {
  if (input == "-") return "-";
  if (is_declared_source(input))
    throw UsageError("{}: nothing can be written beside an address; give -o FILE", input);
  std::filesystem::path path(path_of(input));
  // ".nii.gz" is one extension to those who have such files.
  if (path.extension() == ".gz" && path.stem().extension() == ".nii") path.replace_extension();
  return text_of(path.replace_extension(path_of(ending)));
}

void refuse_terminal(const Ranks& ranks, const std::string& output, const char* what) {
  if (output != "-" || !is_terminal(standard_output)) return;
  if (ranks.count() > 1)
    throw UsageError("standard output: is a terminal under mpirun, which changes bytes; give -o FILE");
  throw UsageError("standard output: {} are not written to a terminal; give -o FILE, or use a pipe", what);
}

void add_format_option(CLI::App& command, std::string& format, const std::string& other) {
  std::vector<std::string> list;
  for (const Format* written : written_formats())
    list.push_back(fmt::format("{} ({})", written->name, written->help));
  const std::string help =
      other.empty()
          ? fmt::format("Format of the output (default: from its extension):\n{}", fmt::join(list, "\n"))
          : fmt::format("Format of the output: {}, or any that decode writes", other);
  add_text_option(command, "--format", format, "FORMAT", help)->check([other](const std::string& given) {
    if (!other.empty() && given == other) return std::string();
    // A program that somebody added is not in the list.
    try {
      format_named(given);
      return std::string();
    } catch (const UsageError& error) {
      return std::string(error.what());
    }
  });
}

const Format& volume_format_option(const std::string& format, const std::string& output) {
  // A device or a named pipe is treated like standard output.
  const Format* named = format_with_extension(output);
  const bool replaces_folder = named != nullptr && named->writes.create != nullptr && is_folder(output);
  const bool is_file = output != "-" && (is_regular_output(output) || replaces_folder);
  if (format.empty()) return is_file ? format_from_name(output) : format_named("raw");
  const Format& asked = format_named(format);
  if (is_file && named != nullptr && named != &asked)
    throw UsageError(
        "--format {}: the extension of {} is that of another format; leave out --format, or name the output "
        "{}",
        format, output, text_of(path_of(output).replace_extension(path_of(asked.extensions.front()))));
  return asked;
}

void add_region_option(CLI::App& command, std::string& region) {
  add_text_option(command, "--region", region, "x0:x1,y0:y1,z0:z1",
                  "Only this region: x0 <= x < x1, likewise y and z; an omitted end is that of the volume");
}

void add_volume_option(CLI::App& command, std::optional<std::int64_t>& volume) {
  add_number_option(command, "--volume", volume, "N", "Volume of a file that holds several, counting from 0");
}

std::int64_t chosen_volume(const std::string& input, const std::optional<std::int64_t>& volume,
                           const RunOptions& run) {
  if (volume && !is_regular_input(input) && (input == "-" || status_of(input)))
    throw UsageError("{}: --volume needs a file, not a pipe; save it to one first", shown_input(input));
  const int volumes = is_regular_input(input) || volume ? count_of_volumes(input) : 1;
  if (volume && (*volume < 0 || *volume >= volumes))
    throw UsageError(
        "{}: no volume {}; {}", shown_input(input), *volume,
        volumes == 1 ? "the only volume is 0" : fmt::format("the volumes are 0 to {}", volumes - 1));
  if (!volume && volumes > 1 && !run.quiet)
    say("tagrid: {}: holds {} volumes; this is volume 0; --volume chooses another one", shown_input(input),
        volumes);
  return volume.value_or(0);
}

WantedRegion wanted_region(const std::string& region) {
  WantedRegion wanted;
  if (region.empty()) return wanted;
  const auto ranges = three_ranges(region);
  if (!ranges)
    throw UsageError(
        "--region {}: must be x0:x1,y0:y1,z0:z1 with whole numbers, such as :,:,20:21 for a slice", region);
  for (std::size_t axis = 0; axis < 3; ++axis)
    std::tie(wanted.low[axis], wanted.high[axis]) = (*ranges)[axis];
  return wanted;
}

void add_vdb_output_options(CLI::App& command, VdbOptions& options) {
  const std::string usual_group = command.option_defaults()->get_group();
  command.option_defaults()->group("OpenVDB output");
  add_text_option(command, "--vdb-grid", options.grid, "NAME",
                  "Name of the grid (default: its name before encoding, or density)");
  add_text_option(command, "--vdb-type", options.type, "float|int32",
                  "Grid type for 8- and 16-bit samples (default: float, which most programs read)")
      ->check(one_of({"float", "int32"}));
  add_number_option(command, "--vdb-background", options.background, "V",
                    "Value of inactive voxels (default: as before encoding, or the first voxel)");
  add_number_option(command, "--vdb-tolerance", options.tolerance, "T",
                    "Turn voxels within T of the background into background (default: 0)");
  command.option_defaults()->group(usual_group);
}

void check_vdb_options(const VdbOptions& options, const Format& format) {
  if (!(options.tolerance >= 0))
    throw UsageError("--vdb-tolerance {}: must not be negative", options.tolerance);
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
  say("tagrid: {}: voxels within {} of the background, {}, became the background{}", output, tolerance,
      number("background").value_or(0), bound);
}

}  // namespace tagrid
