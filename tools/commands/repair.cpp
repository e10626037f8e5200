// tagrid repair: rebuilds damaged stretches of a .tag file from its parity.

#include <fmt/format.h>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/open_source.h"
#include "io/files/output_file.h"
#include "io/parity/parity.h"
#include "io/text/text.h"
#include "tools/commands/commands.h"
#include "tools/options/encoding_options.h"
#include "tools/options/output_options.h"
#include "tools/repair/repair.h"
#include "tools/report/process.h"

namespace tagrid {
namespace {

struct RepairCommand {
  std::string input;
  OutputOptions output;
  RunOptions run;

  void execute(Ranks& ranks) const {
    run.obey_memory_limit();
    if (output.path.empty()) throw UsageError("give -o OUT, a new file: repair does not change its input");
    require_input_file(input, "the file to repair");
    if (output.path == "-" || !is_regular_output(output.path))
      throw UsageError("{}: the output must be a regular file", shown_output(output.path));
    refuse_same_file(input, output.path);
    refuse_same_file(parity_beside(input), output.path);
    check_output(output.path, output.overwrite);
    remove_abandoned(run, {input}, {output.path});
    const UnchangedFiles watched({input});
    const auto parity = survey_parity(input, run, "repairing a file");
    if (!parity)
      throw BrokenInput(
          "{}: has no parity, or none of its descriptions is left, so that nothing can be repaired{}",
          shown_input(input), salvage_advice(input));
    const auto& [file, condition] = *parity;
    if (!condition.is_repairable()) {
      if (!run.quiet && !is_of_another_file(*parity)) tell_what_is_lost(condition);
      throw BrokenInput("{}: {}{}", shown_input(input), why_not_repairable(*parity, input),
                        salvage_advice(input));
    }
    const bool is_proven = repair_file(*parity, watched, input, output.path, output.overwrite, run, ranks);
    if (!run.quiet) tell(file, condition);
    if (!is_proven)
      warn(run, "{}: is of a newer version, which this tagrid does not read, so only its parity was checked",
           printable(output.path));
  }

  void tell_what_is_lost(const ParityCondition& condition) const {
    for (const Stretch& stretch : condition.lost)
      fmt::print("{}: bytes {} to {} cannot be repaired\n", printable(input), stretch.begin, stretch.end - 1);
    std::fflush(stdout);  // the error follows on another stream
  }

  void tell(const ProtectedFile& file, const ParityCondition& condition) const {
    for (const Stretch& stretch : condition.damaged)
      fmt::print("{}: bytes {} to {} were repaired\n", printable(input), stretch.begin, stretch.end - 1);
    const bool damages_beside = file.is_beside() && (condition.damaged_parity > 0 || condition.damaged_frame);
    const std::string damage = damages_beside && condition.damaged_blocks > 0
                                   ? counted(condition.damaged_blocks, "damaged block")
                                   : damage_text(condition);
    std::string what = "repaired " + damage;
    if (condition.is_file_intact())
      what = damages_beside || condition.is_intact() ? "nothing was damaged"
                                                     : "repaired, only the parity was damaged";
    else if (condition.damaged_blocks == 0)
      what = "bytes after the end were left out";
    fmt::print("{}: {}; all checksums agree\n", printable(output.path), what);
    std::fflush(stdout);  // a warning may follow on another stream
    const std::uint64_t size = FileSource(input).size();
    if (file.is_beside() && size > file.whole_size())
      warn(run, "{}: {} bytes after the end, such as parity, were left out; protect {} again",
           shown_input(input), size - file.whole_size(), printable(output.path));
    if (damages_beside)
      warn(run, "{}: is damaged, and was not repaired; protect {} again", parity_beside(input),
           printable(output.path));
  }
};

}  // namespace

void require_input_file(const std::string& path, const char* what) {
  require_tag_input(path);
  if (path == "-" || (status_of(path) && !is_regular_input(path)))
    throw UsageError("{}: {} must be a regular file; save it as one first", shown_input(path), what);
}

Action add_repair_command(CLI::App& app) {
  auto state = std::make_shared<RepairCommand>();
  CLI::App* command = app.add_subcommand("repair", "Rebuild damaged parts of a .tag file from its parity");
  command->add_option("INPUT", state->input, ".tag file that has parity, in it or beside it as INPUT.parity")
      ->required();
  add_output_options(*command, state->output);
  add_run_options(*command, state->run);
  add_memory_option(*command, state->run);
  return [state](Ranks& ranks) { state->execute(ranks); };
}

}  // namespace tagrid
