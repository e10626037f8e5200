// tagrid phantom: writes an artificial CT volume of any size.

#include "pipeline/phantom/phantom.h"

#include "tools/commands/commands.h"
#include "tools/options/encoding_options.h"
#include "tools/options/output_options.h"
#include "tools/report/run_report.h"

namespace tagrid {
namespace {

struct PhantomCommand {
  std::string dims;
  std::string type = "int16";
  std::uint64_t seed = 1;
  std::string format;
  OutputOptions output;
  RunOptions run;

  void execute(const Ranks& ranks) const {
    const PhantomOptions options = {dims_option(dims), sample_type_option(type), seed};
    const std::string path = output.path.empty() ? "-" : output.path;
    refuse_terminal(ranks, path, "samples");
    const Format& chosen = volume_format_option(format, path);
    remove_abandoned(run, {}, {path, samples_path(path, chosen)});
    RunReport report(run.json, run.thread_count(), output.overwrite, "phantom", "", path,
                     samples_path(path, chosen));
    Finished<std::uint64_t> phantom = write(options, path, chosen);
    report.write({options.dims, options.type, {{"seed", seed}}, 0, phantom.result, nullptr}, phantom);
  }

  Finished<std::uint64_t> write(const PhantomOptions& options, const std::string& path,
                                const Format& chosen) const {
    ProgressMeter meter(run.progress, run.quiet, "making", 1);
    return write_phantom({.options = options,
                          .output = path,
                          .format = chosen,
                          .overwrite = output.overwrite,
                          .threads = run.thread_count(),
                          .progress = meter.progress()});
  }
};

}  // namespace

Action add_phantom_command(CLI::App& app) {
  auto state = std::make_shared<PhantomCommand>();
  CLI::App* command =
      app.add_subcommand("phantom", "Create a synthetic CT-like volume of any size, for tests");
  add_dims_option(*command, state->dims)->required();
  add_text_option(*command, "--type", state->type, "TYPE", "Sample type (default: int16)");
  add_number_option(*command, "--seed", state->seed, "N", "Select the volume (default: 1)");
  add_output_options(*command, state->output);
  add_format_option(*command, state->format);
  add_run_options(*command, state->run);
  add_json_option(*command, state->run);
  return [state](Ranks& ranks) { state->execute(ranks); };
}

}  // namespace tagrid
