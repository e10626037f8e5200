// tagrid protect: adds parity to a .tag file.

#include <algorithm>
#include <span>
#include <vector>

#include "io/files/file_attributes.h"
#include "io/files/held_files.h"
#include "io/files/open_source.h"
#include "io/files/output_file.h"
#include "io/parity/parity.h"
#include "io/tag/file.h"
#include "io/text/text.h"
#include "pipeline/memory/parity.h"
#include "tools/commands/commands.h"
#include "tools/options/encoding_options.h"
#include "tools/options/output_options.h"
#include "tools/report/process.h"

namespace tagrid {
namespace {

struct ProtectCommand {
  std::string input, share;
  bool beside = false, overwrite = false;
  RunOptions run;

  void execute(Ranks&) const {
    run.obey_memory_limit();
    if (share.empty()) throw UsageError("give --parity P%, the size of the parity, such as 5%");
    const auto asked = parity_option("--parity", share);
    if (!asked) throw UsageError("--parity none: there is nothing to add; give a share, such as 5%");
    require_input_file(input, "the file to protect");
    const std::string target = file_of_link(input);
    const std::string path = beside ? parity_beside(target) : target;
    remove_abandoned(run, {}, {path});
    const FileSource file(input);
    if (const auto parity = parity_at_end(file))
      throw UsageError("{}: already has parity of {}", shown_input(input), text_of_share(parity->share));
    // Parity of a damaged file would keep its damage.
    TagReader reader(input);
    reader.read_to_end();
    const std::uint64_t memory =
        memory_for_stripes(run.memory, ParityLayout::of(file.size(), *asked), "making parity");
    const UnchangedFiles watched({input});
    // A copy, so that a crash leaves the file as it was.
    OutputFile output(path, beside ? overwrite : true, {.like = attributes_of(input)});
    if (!beside) copy(file, output);
    const std::uint64_t base = beside ? 0 : file.size();
    const std::uint64_t end = write_parity(
        file, *asked, base,
        [&](std::uint64_t position, std::span<const std::byte> bytes) { output.write_at(position, bytes); },
        memory);
    {
      // Meanwhile, another run may have given this name to another file, which this copy must not
      // replace.
      const OutputLock lock(target);
      watched.require();
      output.commit();
    }
    if (!beside && is_regular_input(parity_beside(target)))
      warn(run, "{}: is of the file without parity; remove it", parity_beside(target));
    if (run.is_verbose()) say("{}: {} bytes of parity", path, end - base);
  }

  static void copy(const ByteSource& from, OutputFile& to) {
    std::vector<std::byte> bytes(std::size_t{1} << 20);
    for (std::uint64_t position = 0; position < from.size();) {
      const std::span part =
          std::span(bytes).first(std::min<std::uint64_t>(bytes.size(), from.size() - position));
      from.read_at(position, part);
      to.write(part);
      position += part.size();
    }
  }
};

}  // namespace

Action add_protect_command(CLI::App& app) {
  auto state = std::make_shared<ProtectCommand>();
  CLI::App* command =
      app.add_subcommand("protect", "Add parity to a .tag file, so that damage can be repaired");
  command->add_option("FILE", state->input, ".tag file")->required();
  add_text_option(*command, "--parity", state->share, "P%", "Size of the parity, in percent of the file");
  command->add_flag("--beside", state->beside, "Write the parity to FILE.parity, and leave FILE as it is");
  command->add_flag("-f,--force", state->overwrite, "Overwrite files that exist");
  add_run_options(*command, state->run);
  add_memory_option(*command, state->run);
  return [state](Ranks& ranks) { state->execute(ranks); };
}

}  // namespace tagrid
