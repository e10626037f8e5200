// tagrid surface: writes the isosurface of a .tag file.

#include "pipeline/meshes/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/meshes/formats.h"
#include "tools/commands/commands.h"
#include "tools/commands/grid_command.h"
#include "tools/report/damage.h"

namespace tagrid {
namespace {

struct SurfaceCommand : GridCommand<SurfaceOptions, SurfaceResult> {
  void execute(const Ranks& ranks) {
    if (is_named_as_one_of(mesh_formats(), output.path))
      throw UsageError(
          "{}: has the extension of a format for tetrahedra, but surface writes triangles; use tagrid mesh",
          output.path);
    options.area = !run.json.empty();
    const auto add_settings = [this](const SurfaceResult& result, nlohmann::ordered_json& settings) {
      settings["iso"] = options.iso;
      settings["vertices"] = result.counts.vertices;
      settings["triangles"] = result.counts.triangles;
      settings["boundary_edges"] = nullptr;
      if (result.boundary_edges) settings["boundary_edges"] = *result.boundary_edges;
      settings["area"] = result.counts.area;
    };
    const SurfaceResult result = write(ranks, {"surface", "surfaces", ".ply"}, write_surface, add_settings);
    if (result.counts.triangles == 0) warn(run, path + ": the surface is empty: " + why_empty(result));
    tell_size(fmt::format("{} vertices, {} triangles", result.counts.vertices, result.counts.triangles),
              result.header);
  }

  std::string why_empty(const SurfaceResult& result) const {
    const Rescale rescale = options.of_samples ? Rescale{} : result.header.metadata.rescale();
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
};

}  // namespace

Action add_surface_command(CLI::App& app) {
  auto state = std::make_shared<SurfaceCommand>();
  CLI::App* command = app.add_subcommand("surface", "Write an isosurface as triangles: PLY, STL, OBJ or VTP");
  add_tag_input(*command, state->input);
  add_output_options(*command, state->output);
  add_number_option(*command, "--iso", state->options.iso, "V",
                    "Value on the surface; samples >= V are inside")
      ->required();
  add_number_option(*command, "--level", state->options.level, "N",
                    "Use the grid only up to level N (default: all levels)");
  add_region_option(*command, state->region);
  add_volume_option(*command, state->volume);
  command->add_flag("--samples", state->options.of_samples, "V is a stored sample instead of a value");
  command->add_flag("--close", state->options.close,
                    "Close the surface at the border of the volume, as if values outside were lower");
  add_job_options(*command, state->run, false);
  return [state](Ranks& ranks) { with_repair_advice(state->input, [&] { state->execute(ranks); }); };
}

}  // namespace tagrid
