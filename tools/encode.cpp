// tagrid encode: a volume to a .tag file.

#include <fmt/format.h>

#include "pipeline/run.h"
#include "tools/commands.h"
#include "tools/encoding_options.h"
#include "tools/input_removal.h"
#include "tools/process.h"
#include "tools/report.h"
#include "tools/run_report.h"
#include "tools/shared_options.h"

namespace tagrid {
namespace {

struct EncodeCommand {
  std::string input;
  OutputOptions output;
  RunOptions run;
  EncodingOptions encoding;
  bool remove = false;

  void execute() const {
    const std::string path = output.path.empty() ? output_beside(input, ".tag") : output.path;
    refuse_terminal_input(input);
    refuse_terminal(path, "compressed bytes");
    const Encoding asked = encoding.checked();
    const auto& description = asked.raw;
    std::vector<std::string> removed_after;
    if (remove) removed_after = removable_volume(input, description, path);
    RunReport report(run, output.overwrite, "encode", input, path);
    if (description) warn_of_order(run, input, *description);

    const EncodeResult result = encode(asked, path, [&](const EncodeResult& written) {
      if (remove) verify_encoding(input, description, written.temporary, run.resources());
      report.write({written.header.parameters.dims, written.header.parameters.type,
                    settings_json(written.header.parameters), written.bytes_in, written.file_bytes,
                    achieved_json(written.index)});
    });
    report.keep();
    if (run.verbosity > 0 && !run.quiet)
      say(summary(result) + "\n" + memory_summary(result.memory, result.times_read) + "\n");
    remove_files(removed_after);
  }

  EncodeResult encode(const Encoding& asked, const std::string& path,
                      const BeforeNaming<EncodeResult>& before_naming) const {
    ProgressMeter meter(run.progress, run.quiet, "encoding", 1);
    return encode_volume(
        input, asked.raw, path, output.overwrite, asked.options, run.resources(),
        [&](std::uint64_t done, std::uint64_t total) { meter.update(done, total); }, before_naming);
  }
};

}  // namespace

Action add_encode_command(CLI::App& app) {
  auto state = std::make_shared<EncodeCommand>();
  CLI::App* command = app.add_subcommand("encode", "Encode a volume into a .tag file");
  command->add_option("INPUT", state->input, "NRRD file, headerless file, or - for the standard input")
      ->required();
  add_output_options(*command, state->output);
  add_encoding_options(*command, state->encoding);
  add_run_options(*command, state->run);
  add_json_option(*command, state->run);
  add_memory_option(*command, state->run);
  add_spool_option(*command, state->run);
  add_removal_options(*command, state->remove);
  return [state] { state->execute(); };
}

}  // namespace tagrid
