// tagrid decode: a .tag file to a volume.

#include "io/errors.h"
#include "pipeline/run.h"
#include "tools/commands.h"
#include "tools/shared_options.h"

namespace tagrid {
namespace {

struct DecodeCommand {
  std::string input;
  OutputOptions output;
  RunOptions run;
  std::string format;

  void execute() const {
    const std::string path = output.path.empty() ? output_beside(input, ".nrrd") : output.path;
    refuse_terminal(path, "samples");
    const VolumeFormat chosen = volume_format_option(format, path);
    ProgressMeter meter(run.progress, run.quiet, "decoding", 1);
    decode_volume(input, path, chosen, output.overwrite, run.thread_count(),
                  [&](std::uint64_t done, std::uint64_t total) { meter.update(done, total); });
  }
};

}  // namespace

Action add_decode_command(CLI::App& app) {
  auto state = std::make_shared<DecodeCommand>();
  CLI::App* command = app.add_subcommand("decode", "Decode a .tag file into a volume");
  command->add_option("INPUT", state->input, ".tag file, or - for the standard input")->required();
  add_output_options(*command, state->output);
  add_format_option(*command, state->format);
  add_run_options(*command, state->run);
  return [state] { state->execute(); };
}

}  // namespace tagrid
