// tagrid surface: writes the isosurface of a .tag file.

#include "pipeline/meshes/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/formats/nrrd/geometry.h"
#include "io/formats/nrrd/rescale.h"
#include "io/volume/lengths.h"
#include "tools/commands/commands.h"
#include "tools/options/shared_options.h"
#include "tools/options/wanted_region.h"
#include "tools/report/process.h"
#include "tools/report/report.h"
#include "tools/report/run_report.h"

namespace tagrid {
namespace {

struct SurfaceCommand {
  std::string input;
  OutputOptions output;
  RunOptions run;
  SurfaceOptions options;
  std::string region;

  void execute(Ranks& ranks) {
    run.obey_memory_limit();
    options.region = wanted_region(region);
    if (output.path.empty() && !options.region.is_all())
      throw UsageError(
          "a region needs -o FILE: without it, the output would have the name of the whole surface");
    const std::string path = output.path.empty() ? output_beside(input, ".ply") : output.path;
    refuse_terminal_input(input);
    refuse_folder(input);
    refuse_terminal(ranks, path, "surfaces");
    options.overwrite = output.overwrite;
    options.area = !run.json.empty();
    remove_abandoned(run, {input}, {path});
    RunReport report(run.json, run.thread_count(), output.overwrite, "surface", input, path);
    Finished<SurfaceResult> surface = write(ranks, path);
    const SurfaceResult& result = surface.result;
    const CodingParameters& parameters = result.header.parameters;
    report.write({parameters.dims, parameters.type, settings_of(result), result.bytes_in, result.bytes_out,
                  achieved_json(result.header, result.index)});
    surface.commit();
    report.keep();
    for (const std::string& warning : result.warnings) warn(run, warning);
    if (const std::string mixed = lost_by_mixed_units(geometry_of(result.header.nrrd_fields)); !mixed.empty())
      warn(run, path + ": " + mixed);
    if (has_uneven_slices(result.header))
      warn(run, path +
                    ": slices of the source lie at unequal distances; in the surface all distances are "
                    "equal");
    if (result.counts.triangles == 0) warn(run, path + ": the surface is empty: " + why_empty(result));
    if (run.verbosity > 0 && !run.quiet) {
      say_line(fmt::format("{} vertices, {} triangles", result.counts.vertices, result.counts.triangles));
      say_line("coordinates: " + coordinates_text(result.header));
    }
  }

  std::string why_empty(const SurfaceResult& result) const {
    const Rescale rescale = options.of_samples ? Rescale{} : rescale_of(result.header.nrrd_fields);
    const double a = rescale.slope * result.index.total.low + rescale.intercept,
                 b = rescale.slope * result.index.total.high + rescale.intercept;
    const double low = std::min(a, b), high = std::max(a, b);
    const std::string one_side = fmt::format("all values are on the same side of {}", options.iso);
    if (!std::isfinite(low) || !std::isfinite(high)) return one_side;
    const std::string span = fmt::format("those of the scan lie between {:.6g} and {:.6g}", low, high);
    const bool is_between = low < options.iso && options.iso <= high;
    if (!is_between || options.level || !options.region.is_all()) return one_side + "; " + span;
    // Voxels reach it, but the grid did not follow them.
    return fmt::format(
        "the vertices of the grid have no surface of {}, although {}; encode the scan with --range auto or "
        "--mesh-error, so that the grid follows such small parts or differences",
        options.iso, span);
  }

  nlohmann::ordered_json settings_of(const SurfaceResult& result) const {
    nlohmann::ordered_json settings = settings_json(result.header.parameters);
    settings["iso"] = options.iso;
    settings["vertices"] = result.counts.vertices;
    settings["triangles"] = result.counts.triangles;
    settings["boundary_edges"] = nullptr;
    if (result.boundary_edges) settings["boundary_edges"] = *result.boundary_edges;
    settings["area"] = result.counts.area;
    return settings;
  }

  Finished<SurfaceResult> write(const Ranks& ranks, const std::string& path) const {
    ProgressMeter meter(run.progress, run.quiet, "meshing", 1);
    return write_surface({.input = input,
                          .output = path,
                          .options = options,
                          .resources = run.resources(ranks),
                          .progress = meter.progress()});
  }
};

}  // namespace

Action add_surface_command(CLI::App& app) {
  auto state = std::make_shared<SurfaceCommand>();
  CLI::App* command = app.add_subcommand(
      "surface", "Write the surface of a value in a .tag file as triangles: PLY, STL, OBJ or VTP");
  command->add_option("INPUT", state->input, ".tag file, or - for standard input")->required();
  add_output_options(*command, state->output);
  add_number_option(*command, "--iso", state->options.iso,
                    "Value on the surface; samples of at least V are inside")
      ->option_text("V")
      ->required();
  add_number_option(*command, "--level", state->options.level,
                    "Use the grid up to this level only; default: all levels")
      ->option_text("N");
  add_region_option(*command, state->region, "Only the surface in tetrahedra that intersect this region");
  command->add_flag("--samples", state->options.of_samples,
                    "V is a stored sample, also where values are slope * sample + intercept");
  command->add_flag("--close", state->options.close,
                    "Close the surface at the border of the volume, as if all values outside were lower");
  add_run_options(*command, state->run);
  add_json_option(*command, state->run);
  add_memory_option(*command, state->run);
  return [state](Ranks& ranks) { state->execute(ranks); };
}

}  // namespace tagrid
