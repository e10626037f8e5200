// tagrid mesh: the tetrahedra of a .tag file.

#include "pipeline/mesh/mesh.h"

#include <fmt/format.h>

#include "tools/commands/commands.h"
#include "tools/options/shared_options.h"
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

  void execute() {
    run.obey_memory_limit();
    const std::string path = output.path.empty() ? output_beside(input, ".vtu") : output.path;
    refuse_terminal_input(input);
    refuse_terminal(path, "meshes");
    options.overwrite = output.overwrite;
    remove_abandoned(run, {input}, {path});
    RunReport report(run.json, run.thread_count(), output.overwrite, "mesh", input, path);
    const MeshResult result = mesh(path, [&](const MeshResult& written) {
      const CodingParameters& parameters = written.header.parameters;
      nlohmann::ordered_json settings = settings_json(parameters);
      settings["points"] = written.points;
      settings["tetrahedra"] = written.tetrahedra;
      report.write({parameters.dims, parameters.type, settings, written.bytes_in, written.bytes_out,
                    achieved_json(written.index)});
    });
    report.keep();
    if (run.verbosity > 0 && !run.quiet)
      say_line(fmt::format("{} points, {} tetrahedra", result.points, result.tetrahedra));
  }

  MeshResult mesh(const std::string& path, const BeforeNaming<MeshResult>& before_naming) const {
    ProgressMeter meter(run.progress, run.quiet, "meshing", 1);
    return write_mesh(
        input, path, options, run.resources(),
        [&](std::uint64_t done, std::uint64_t total) { meter.update(done, total); }, before_naming);
  }
};

}  // namespace

Action add_mesh_command(CLI::App& app) {
  auto state = std::make_shared<MeshCommand>();
  CLI::App* command = app.add_subcommand("mesh", "Write the tetrahedra of a .tag file as a VTU mesh");
  command->add_option("INPUT", state->input, ".tag file, or - for the standard input")->required();
  add_output_options(*command, state->output);
  add_number_option(*command, "--level", state->options.level,
                    "The prefix of the grid at this level: no point of a higher one; default: all of it")
      ->option_text("N");
  command->add_flag("--padded", state->options.padded,
                    "Fill whole root cubes, instead of ending at the first and last samples");
  add_run_options(*command, state->run);
  add_json_option(*command, state->run);
  add_memory_option(*command, state->run);
  return [state] { state->execute(); };
}

}  // namespace tagrid
