// tagrid verify: is a .tag file whole, and is it what was encoded?

#include <fmt/format.h>

#include "pipeline/verify.h"
#include "tools/commands.h"
#include "tools/shared_options.h"

namespace tagrid {
namespace {

struct VerifyCommand {
  std::string input, original;
  RunOptions run;
  RawOptions raw;

  void execute() const {
    ProgressMeter meter(run.progress, run.quiet, "verifying", 1);
    const VerifyResult result =
        verify_file(input, original, raw.description(), run.thread_count(),
                    [&](std::uint64_t done, std::uint64_t total) { meter.update(done, total); });
    if (run.quiet) return;
    fmt::print("{}: {} bricks are whole; the grid of {} active points is conforming\n", input, result.bricks,
               result.active_points);
    if (result.max_error) fmt::print("largest error against {}: {}\n", original, *result.max_error);
  }
};

}  // namespace

Action add_verify_command(CLI::App& app) {
  auto state = std::make_shared<VerifyCommand>();
  CLI::App* command =
      app.add_subcommand("verify", "Check a .tag file: checksums, grid, statistics, the original");
  command->add_option("INPUT", state->input, ".tag file, or - for the standard input")->required();
  command->add_option("--against", state->original, "Compare every voxel with this volume")
      ->option_text("ORIGINAL");
  add_raw_options(*command, state->raw);
  add_run_options(*command, state->run);
  return [state] { state->execute(); };
}

}  // namespace tagrid
