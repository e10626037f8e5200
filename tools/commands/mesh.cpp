// tagrid mesh: writes the tetrahedra of a .tag file.

#include "pipeline/meshes/mesh.h"
#include "io/errors/errors.h"
#include "io/metadata/metadata.h"
#include "pipeline/parts/mesh_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/meshes/formats.h"
#include "io/text/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/grid_command.h"
#include "tools/options/material_options.h"
#include "tools/report/damage.h"

namespace tagrid {
namespace {

struct MeshCommand : GridCommand<MeshOptions, MeshResult> {
  void execute(const Ranks& ranks) {
    if (is_named_as_one_of(surface_formats(), output.path))
      throw UsageError(
          "{}: has the extension of a surface format, but mesh writes tetrahedra; use tagrid surface --iso V",
          output.path);
    if (is_named_as_one_of(material_mesh_formats(), output.path) &&
        !is_named_as_one_of(mesh_formats(), output.path))
      throw UsageError("{}: this format holds meshes with materials; give --materials or --labels",
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

// Lines for people: a row for each material, and angles.
void tell_quality(const MaterialMeshResult& result) {
  const MeshQuality& quality = result.quality;
  const std::string unit = result.unit.empty() ? "" : " " + result.unit;
  say("{:<20} {:>12} {:>14} {:>14} {:>6} {:>14}", "material", "tetrahedra", "volume", "area", "parts",
      "touching edges");
  for (const MeshQuality::OfMaterial& m : quality.materials)
    say("{:<20} {:>12} {:>14.6g} {:>14.6g} {:>6} {:>14}", m.name, m.tetrahedra, m.volume, m.area, m.parts,
        m.touching_edges);
  say("{:<20} {:>12} {:>12}", "dihedral angles", "smallest", "largest");
  for (std::size_t bin = 0; bin < quality.smallest.size(); ++bin)
    if (quality.smallest[bin] + quality.largest[bin] > 0)
      say("{:>6.0f} to {:>3.0f} degrees  {:>12} {:>12}",
          static_cast<double>(bin) * MeshQuality::degrees_of_bin,
          static_cast<double>(bin + 1) * MeshQuality::degrees_of_bin, quality.smallest[bin],
          quality.largest[bin]);
  say("angles are between {:.1f} and {:.1f} degrees; cubes have edges of {:.6g} to {:.6g}{}",
      quality.smallest_angle, quality.largest_angle, result.fine, result.coarse, unit);
}

void add_materials(const MaterialMeshResult& result, nlohmann::ordered_json& settings) {
  const MeshQuality& quality = result.quality;
  settings["points"] = result.points;
  settings["tetrahedra"] = result.tetrahedra;
  settings["size"] = {result.fine, result.coarse};
  settings["unit"] = result.unit.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(result.unit);
  auto& materials = settings["materials"] = nlohmann::ordered_json::array();
  for (const MeshQuality::OfMaterial& m : quality.materials)
    materials.push_back({{"name", m.name},
                         {"tetrahedra", m.tetrahedra},
                         {"volume", m.volume},
                         {"area", m.area},
                         {"parts", m.parts},
                         {"touching_edges", m.touching_edges},
                         {"removed_parts", m.removed_parts},
                         {"removed_tetrahedra", m.removed_tetrahedra}});
  auto& surfaces = settings["surfaces"] = nlohmann::ordered_json::array();
  for (const MaterialSurface& s : result.surfaces)
    surfaces.push_back({{"name", s.name}, {"triangles", s.count}});
  settings["smallest_angle"] = quality.smallest_angle;
  settings["largest_angle"] = quality.largest_angle;
  settings["degrees_of_bin"] = MeshQuality::degrees_of_bin;
  settings["smallest_angles"] = quality.smallest;
  settings["largest_angles"] = quality.largest;
}

struct MaterialMeshCommand : GridCommand<MaterialMeshOptions, MaterialMeshResult> {
  void execute(Ranks& ranks, const MaterialTexts& texts) {
    options = material_options(texts);
    options.counts_edges = texts.quality || !run.json.empty();
    const MaterialMeshResult result = write(
        ranks, {"mesh", "meshes", ".vtu", false},
        [&](const MaterialMeshRun& mesh) { return write_material_mesh(ranks, mesh); }, add_materials);
    if (!run.quiet) tell_parts(result.quality);
    if (texts.quality) tell_quality(result);
    const auto& materials = result.quality.materials;
    const auto present = std::count_if(materials.begin(), materials.end(),
                                       [](const MeshQuality::OfMaterial& m) { return m.tetrahedra > 0; });
    tell_size(fmt::format("{} points, {} tetrahedra of {}, {}", result.points, result.tetrahedra,
                          counted(static_cast<std::uint64_t>(present), "material"),
                          counted(result.surfaces.size(), "surface")),
              result.header);
  }

  void tell_parts(const MeshQuality& quality) const {
    std::string removed, all;
    for (const MeshQuality::OfMaterial& m : quality.materials) {
      if (m.removed_parts > 0)
        removed += fmt::format("{}{} of {} ({} of {} tetrahedra)", removed.empty() ? "" : ", ",
                               counted(static_cast<std::uint64_t>(m.removed_parts), "part"), m.name,
                               m.removed_tetrahedra, m.tetrahedra + m.removed_tetrahedra);
      if (m.parts > 1) all += fmt::format("{}{} parts of {}", all.empty() ? "" : ", ", m.parts, m.name);
    }
    if (!removed.empty()) say("tagrid: {}: left out {}", path, removed);
    // Solvers end at parts that nothing holds.
    const bool is_one =
        std::ranges::count_if(quality.materials, [](const auto& m) { return m.tetrahedra > 0; }) == 1;
    if (!all.empty() && is_one && options.parts.is_all())
      say("tagrid: {}: {} do not touch each other; see --parts", path, all);
  }
};

/// The command as it was given: for the adaptive grid, or for materials.
struct MeshState : MeshCommand {
  MaterialTexts materials;

  void execute(Ranks& ranks) {
    if (!materials.are_given()) {
      if (const std::string option = first_given(materials); !option.empty())
        throw UsageError("{}: applies only to materials; give --materials or --labels as well", option);
      return MeshCommand::execute(ranks);
    }
    if (options.level || options.coarsen || options.of_samples || options.padded)
      throw UsageError(
          "--materials, --labels: cannot be combined with --level, --coarsen, --samples or --padded, which "
          "are about "
          "the adaptive grid");
    MaterialMeshCommand command;
    command.input = input;
    command.output = output;
    command.run = run;
    command.region = region;
    command.volume = volume;
    command.execute(ranks, materials);
  }
};

}  // namespace

Action add_mesh_command(CLI::App& app) {
  auto state = std::make_shared<MeshState>();
  CLI::App* command =
      app.add_subcommand("mesh", "Write a tetrahedral mesh of the grid, or of materials for solvers");
  add_tag_input(*command, state->input);
  add_output_options(*command, state->output);
  add_number_option(*command, "--level", state->options.level, "N",
                    "Use the grid only up to level N (default: all levels)");
  add_number_option(*command, "--coarsen", state->options.coarsen, "E",
                    "Write the coarsest mesh that is within E of every decoded voxel");
  command->add_flag("--samples", state->options.of_samples, "With --coarsen: E is in stored samples");
  add_region_option(*command, state->region);
  add_volume_option(*command, state->volume);
  command->add_flag("--padded", state->options.padded,
                    "Fill complete root cubes instead of ending at the first and last samples");
  add_material_options(*command, state->materials);
  add_job_options(*command, state->run, false);
  return [state](Ranks& ranks) { with_repair_advice(state->input, [&] { state->execute(ranks); }); };
}

}  // namespace tagrid
