// tagrid info: describes the content of a .tag file.

#include <fmt/format.h>

#include "io/tag/bricks.h"
#include "tools/commands/commands.h"
#include "tools/options/shared_options.h"
#include "tools/report/report.h"

namespace tagrid {

Action add_info_command(CLI::App& app) {
  struct State {
    std::string input;
    bool json = false;
    RunOptions run;  // for scripts that pass these options to every command; they have no effect here
  };
  auto state = std::make_shared<State>();
  CLI::App* command = app.add_subcommand(
      "info", "Print geometry, parameters, where the bytes are, and active points per level");
  command->add_option("INPUT", state->input, ".tag file, or - for standard input")->required();
  add_run_options(*command, state->run);
  command->add_flag("--json", state->json, "Print one JSON object")->disable_flag_override();
  return [state](Ranks&) {
    refuse_terminal_input(state->input);
    const TagSummary summary = summary_of(state->input);
    if (state->json)
      fmt::print("{}\n", info_json(summary.header, summary.index, summary.sizes).dump(2));
    else
      fmt::print("{}", info_text(summary.header, summary.index, summary.sizes));
  };
}

}  // namespace tagrid
