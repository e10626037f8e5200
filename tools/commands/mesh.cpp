// tagrid mesh: writes the tetrahedra of a .tag file.

#include "pipeline/meshes/mesh.h"

#include <fmt/format.h>

#include <cmath>

#include "io/formats/nrrd/geometry.h"
#include "io/formats/nrrd/rescale.h"
#include "io/text/printable.h"
#include "io/volume/lengths.h"
#include "tools/commands/commands.h"
#include "tools/options/shared_options.h"
#include "tools/options/wanted_region.h"
#include "tools/report/process.h"
#include "tools/report/report.h"
#include "tools/report/run_report.h"

namespace tagrid {
namespace {

struct MeshCommand {
  std::string input;
  OutputOptions output;
  RunOptions run;
  MeshOptions options;
  std::string region;

  void execute(Ranks& ranks) {
    run.obey_memory_limit();
    options.region = wanted_region(region);
    if (output.path.empty() && !options.region.is_all())
      throw UsageError(
          "a region needs -o FILE: without it, the output would have the name of the whole mesh");
    const std::string path = output.path.empty() ? output_beside(input, ".vtu") : output.path;
    refuse_terminal_input(input);
    refuse_folder(input);
    refuse_terminal(ranks, path, "meshes");
    if (options.of_samples && !options.coarsen)
      throw UsageError("--samples: says what the error of --coarsen means; give --coarsen as well");
    options.overwrite = output.overwrite;
    remove_abandoned(run, {input}, {path});
    RunReport report(run.json, run.thread_count(), output.overwrite, "mesh", input, path);
    Finished<MeshResult> mesh = write(ranks, path);
    const MeshResult& result = mesh.result;
    const CodingParameters& parameters = result.header.parameters;
    nlohmann::ordered_json settings = settings_json(parameters);
    if (options.coarsen) settings["coarsen"] = *options.coarsen;
    settings["points"] = result.points;
    settings["tetrahedra"] = result.tetrahedra;
    report.write({parameters.dims, parameters.type, settings, result.bytes_in, result.bytes_out,
                  achieved_json(result.header, result.index)});
    mesh.commit();
    report.keep();
    for (const std::string& warning : result.warnings) warn(run, warning);
    if (const std::string mixed = lost_by_mixed_units(geometry_of(result.header.nrrd_fields)); !mixed.empty())
      warn(run, path + ": " + mixed);
    if (has_uneven_slices(result.header))
      warn(run,
           path + ": slices of the source lie at unequal distances; in the mesh all distances are equal");
    tell_of_values(path, result.header.nrrd_fields);
    if (run.verbosity > 0 && !run.quiet) {
      say_line(fmt::format("{} points, {} tetrahedra", result.points, result.tetrahedra));
      say_line("coordinates: " + coordinates_text(result.header));
    }
  }

  void tell_of_values(const std::string& path, const std::string& fields) const {
    if (has_slopes_of_slices(fields))
      warn(run, path + ": slices have slopes of their own; in the mesh, value is the stored sample" +
                    (options.coarsen && !options.of_samples
                         ? fmt::format(", and the largest slope, {:.6g}, turns --coarsen into an "
                                       "error of samples",
                                       largest_slope(fields))
                         : ""));
    const Rescale rescale = rescale_of(fields);
    if (run.quiet || (rescale.slope == 1 && rescale.intercept == 0)) return;
    const std::string unit = rescale.units.empty() ? "" : fmt::format(" ({})", printable(rescale.units));
    say_line(fmt::format("tagrid: {}: value is the stored sample; rescaled is {:.6g} * value {} {:.6g}{}",
                         path == "-" ? "standard output" : path, rescale.slope,
                         rescale.intercept < 0 ? '-' : '+', std::abs(rescale.intercept), unit));
  }

  Finished<MeshResult> write(const Ranks& ranks, const std::string& path) const {
    ProgressMeter meter(run.progress, run.quiet, "meshing", 1);
    return write_mesh({.input = input,
                       .output = path,
                       .options = options,
                       .resources = run.resources(ranks),
                       .progress = meter.progress()});
  }
};

}  // namespace

Action add_mesh_command(CLI::App& app) {
  auto state = std::make_shared<MeshCommand>();
  CLI::App* command =
      app.add_subcommand("mesh", "Write the tetrahedra of a .tag file as a mesh: VTU, VTKHDF or Gmsh");
  command->add_option("INPUT", state->input, ".tag file, or - for standard input")->required();
  add_output_options(*command, state->output);
  add_number_option(*command, "--level", state->options.level,
                    "Use the grid up to this level only; default: all levels")
      ->option_text("N");
  add_number_option(*command, "--coarsen", state->options.coarsen,
                    "Write the coarsest mesh whose values are within E of all decoded voxels")
      ->option_text("E");
  command->add_flag("--samples", state->options.of_samples,
                    "With --coarsen: E is an error of stored samples, not of values");
  add_region_option(*command, state->region, "Only the tetrahedra that intersect this region");
  command->add_flag("--padded", state->options.padded,
                    "Fill whole root cubes instead of ending at the first and last samples");
  add_run_options(*command, state->run);
  add_json_option(*command, state->run);
  add_memory_option(*command, state->run);
  return [state](Ranks& ranks) { state->execute(ranks); };
}

}  // namespace tagrid
