// tagrid info: describes the content of a .tag file.

#include <fmt/format.h>

#include "io/tag/bricks.h"
#include "pipeline/verify/verify.h"
#include "tools/commands/commands.h"
#include "tools/options/shared_options.h"
#include "tools/report/damage.h"
#include "tools/report/info.h"
#include "tools/report/report.h"

namespace tagrid {

Action add_info_command(CLI::App& app) {
  struct State {
    std::string input;
    bool json = false, no_levels = false;
    RunOptions run;

    TagSummary summary(const Ranks& ranks) const {
      if (no_levels) return summary_of(input);
      ProgressMeter meter(run.progress, run.quiet, "finding the grid", 1);
      return summary_with_levels(input, run.resources(ranks), meter.progress());
    }
  };
  auto state = std::make_shared<State>();
  CLI::App* command =
      app.add_subcommand("info", "Print geometry, parameters, sizes and active points per level");
  add_tag_input(*command, state->input);
  command->add_flag("--no-levels", state->no_levels,
                    "Omit the table of levels, which can require decoding the entire file");
  add_run_options(*command, state->run);
  add_memory_option(*command, state->run);
  command->add_flag("--json", state->json, "Print one JSON object")->disable_flag_override();
  return [state](Ranks& ranks) {
    state->run.obey_memory_limit();
    require_tag_input(state->input);
    with_repair_advice(state->input, [&] {
      const TagSummary file = state->summary(ranks);
      if (state->json)
        fmt::print("{}\n", written_json(info_json(file, !state->no_levels), 2));
      else
        fmt::print("{}", info_text(file, !state->no_levels));
    });
  };
}

}  // namespace tagrid
