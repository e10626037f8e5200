// tagrid mesh: writes the tetrahedra of a .tag file.

#include "pipeline/meshes/mesh.h"
#include "io/metadata/metadata.h"

#include <fmt/format.h>

#include <cmath>

#include "io/meshes/formats.h"
#include "io/text/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/grid_command.h"
#include "tools/report/damage.h"

namespace tagrid {
namespace {

struct MeshCommand : GridCommand<MeshOptions, MeshResult> {
  void execute(const Ranks& ranks) {
    if (is_named_as_one_of(surface_formats(), output.path))
      throw UsageError(
          "{}: has the extension of a surface format, but mesh writes tetrahedra; use tagrid surface --iso V",
          output.path);
    if (options.of_samples && !options.coarsen)
      throw UsageError("--samples: applies only with --coarsen; give --coarsen as well");
    const auto add_settings = [this](const MeshResult& result, nlohmann::ordered_json& settings) {
      if (options.coarsen) settings["coarsen"] = *options.coarsen;
      settings["points"] = result.points;
      settings["tetrahedra"] = result.tetrahedra;
    };
    const MeshResult result = write(ranks, {"mesh", "meshes", ".vtu"}, write_mesh, add_settings);
    tell_of_values(result.header.metadata);
    tell_size(fmt::format("{} points, {} tetrahedra", result.points, result.tetrahedra), result.header);
  }

  void tell_of_values(const Metadata& metadata) const {
    if (metadata.has_slopes_of_slices())
      warn(run,
           path + ": each slice has its own slope; in the mesh, value is the stored sample" +
               (options.coarsen && !options.of_samples
                    ? fmt::format(", and the largest slope, {:.6g}, converts --coarsen to stored samples",
                                  metadata.largest_slope())
                    : ""));
    const Rescale& rescale = metadata.rescale();
    if (run.quiet || (rescale.slope == 1 && rescale.intercept == 0)) return;
    const std::string unit = rescale.units.empty() ? "" : fmt::format(" ({})", printable(rescale.units));
    say("tagrid: {}: value is the stored sample; rescaled is {:.6g} * value {} {:.6g}{}", shown_output(path),
        rescale.slope, rescale.intercept < 0 ? '-' : '+', std::abs(rescale.intercept), unit);
  }
};

}  // namespace

Action add_mesh_command(CLI::App& app) {
  auto state = std::make_shared<MeshCommand>();
  CLI::App* command =
      app.add_subcommand("mesh", "Write the adaptive grid as a tetrahedral mesh: VTU, VTKHDF or Gmsh");
  add_tag_input(*command, state->input);
  add_output_options(*command, state->output);
  add_number_option(*command, "--level", state->options.level, "N",
                    "Use the grid only up to level N (default: all levels)");
  add_number_option(*command, "--coarsen", state->options.coarsen, "E",
                    "Write the coarsest mesh that is within E of every decoded voxel");
  command->add_flag("--samples", state->options.of_samples,
                    "With --coarsen: E is in units of stored samples, not of values");
  add_region_option(*command, state->region, "Only the tetrahedra that intersect this region");
  add_volume_option(*command, state->volume);
  command->add_flag("--padded", state->options.padded,
                    "Fill complete root cubes instead of ending at the first and last samples");
  add_job_options(*command, state->run, false);
  return [state](Ranks& ranks) { with_repair_advice(state->input, [&] { state->execute(ranks); }); };
}

}  // namespace tagrid
