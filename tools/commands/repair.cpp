// tagrid repair: rebuilds damaged stretches of a .tag file from its parity.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/held_files.h"
#include "io/files/open_source.h"
#include "io/files/output_file.h"
#include "io/parity/parity.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "io/text/text.h"
#include "pipeline/memory/parity.h"
#include "pipeline/run/run.h"
#include "tools/commands/commands.h"
#include "tools/options/encoding_options.h"
#include "tools/options/output_options.h"
#include "tools/report/process.h"

namespace tagrid {
namespace {

/// A repaired file, but for a stretch that is as it was in the damaged file.
class WithStretch : public ByteSource {
 public:
  WithStretch(const FileSource& damaged, const FileSource& repaired)
      : damaged_(damaged), repaired_(repaired) {}

  void choose(std::uint64_t begin, std::uint64_t end) { begin_ = begin, end_ = end; }
  std::uint64_t size() const override { return repaired_.size(); }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override {
    repaired_.read_at(position, to);
    const std::uint64_t first = std::max(position, begin_), last = std::min(position + to.size(), end_);
    if (first < last) damaged_.read_at(first, to.subspan(first - position, last - first));
  }
  const std::string& name() const override { return damaged_.name(); }

 private:
  const FileSource &damaged_, &repaired_;
  std::uint64_t begin_ = 0, end_ = 0;
};

/// The checksum of the index and the footer, which include those of all blocks; nothing if the end of a file is damaged.
std::vector<std::byte> end_of(const std::string& path) {
  try {
    const auto file = std::make_shared<FileSource>(path);
    const TagSizes sizes = TagBricks(file).sizes();
    std::vector<std::byte> end(8 + footer_size);
    file->read_at(sizes.file - sizes.parity - end.size(), end);
    return end;
  } catch (const BrokenInput&) {
    return {};
  }
}

/// True if a file is not damaged at its beginning and end, but of a newer version of the format.
bool needs_newer_program(const std::string& path) {
  try {
    TagBricks(std::make_shared<FileSource>(path));
    return false;
  } catch (const BrokenInput& broken) {
    return is_newer_format(broken);
  }
}

/// True if something in a damaged file is intact by its own checksums, but is not what was rebuilt: the parity is of another
/// file. The checksum of a block includes those of all before it.
bool contradicts(const std::string& damaged, const std::string& repaired) {
  try {
    if (serialize_header(TagReader(damaged).header()) != serialize_header(TagReader(repaired).header()))
      return true;
  } catch (const BrokenInput&) {
    // The header is damaged.
  }
  if (const auto end = end_of(damaged); !end.empty() && end != end_of(repaired)) return true;
  const FileSource before(damaged), after(repaired);
  const auto mixed = std::make_shared<WithStretch>(before, after);
  const TagBricks file(mixed);
  // check() throws BrokenInput if the block up to `end` is damaged.
  const auto differs = [&](std::uint64_t begin, std::uint64_t end, const auto& check) {
    if (end > before.size()) return false;
    std::array<std::byte, 8> checksum_before, checksum_after;
    before.read_at(end - 8, checksum_before);
    after.read_at(end - 8, checksum_after);
    if (checksum_before == checksum_after) return false;
    mixed->choose(begin - 8, end);
    try {
      check();
    } catch (const BrokenInput&) {
      return false;
    }
    return true;
  };
  for (std::int64_t brick = 0; brick < file.count(); ++brick) {
    mixed->choose(0, 0);
    const std::uint64_t start = file.start(brick);
    if (differs(start, start + file.block_bytes(brick), [&] { file.read(brick); })) return true;
  }
  for (const Member& member : file.index().members)
    if (differs(member.offset, member.end(), [&] { file.check(member); })) return true;
  return false;
}

struct RepairCommand {
  std::string input;
  OutputOptions output;
  RunOptions run;

  void execute(Ranks& ranks) const {
    run.obey_memory_limit();
    if (output.path.empty()) throw UsageError("give -o OUT, a new file: repair does not change its input");
    require_input_file(input, "the file to repair");
    if (output.path == "-" || !is_regular_output(output.path))
      throw usage_error("{}: the output must be a regular file", shown_output(output.path));
    refuse_same_file(input, output.path);
    refuse_same_file(parity_beside(input), output.path);
    check_output(output.path, output.overwrite);
    remove_abandoned(run, {input}, {output.path});
    const auto parity = survey_parity(input, run, "repairing a file");
    if (!parity)
      throw broken_input_error(
          "{}: has no parity, or none of its descriptions is left; nothing can be repaired",
          shown_input(input));
    const auto& [file, condition] = *parity;
    if (!condition.is_repairable()) {
      if (!run.quiet && !is_of_another_file(*parity)) tell_what_is_lost(condition);
      throw broken_input_error("{}: {}", shown_input(input), why_not_repairable(*parity, input));
    }
    OutputFile repaired(output.path, output.overwrite, {.like = attributes_of(input)});
    file.repair(
        [&](std::uint64_t position, std::span<const std::byte> bytes) { repaired.write_at(position, bytes); },
        memory_for_stripes(run.memory, file.layout(), "repairing a file"));
    const bool is_newer = needs_newer_program(repaired.temporary());
    if (!is_newer && file.is_beside() && contradicts(input, repaired.temporary()))
      throw broken_input_error(
          "{}: what is intact by its own checksums is not what {} protects, which is of another file, or of "
          "an earlier one; remove it, or protect the file again",
          shown_input(input), parity_beside(input));
    if (!is_newer) prove(ranks, repaired.temporary());
    {
      const OutputLock lock(file_of_link(output.path));
      repaired.commit();
    }
    if (!run.quiet) tell(file, condition);
    if (is_newer)
      warn(run, "{}: is of a newer version, which this tagrid does not read, so only its parity was checked",
           printable(output.path));
  }

  /// The blocks are those that were protected. The file's own checksums show that these were whole.
  void prove(Ranks& ranks, const std::string& path) const {
    Ranks alone;
    try {
      ProgressMeter meter(run.progress, run.quiet, "verifying", 1);
      verify_file(alone, {.input = path, .resources = run.resources(ranks), .progress = meter.progress()});
    } catch (const BrokenInput& broken) {
      throw broken_input_error(
          "{}: is repaired to what was protected, but that is not a whole .tag file, and was not written "
          "({})",
          shown_input(input), broken.what());
    }
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
    throw usage_error("{}: {} must be a regular file; save it as one first", shown_input(path), what);
}

std::string damage_text(const ParityCondition& condition) {
  if (condition.is_file_intact()) return "only the parity is damaged";
  if (condition.damaged_blocks == 0) return "bytes follow the end";
  return fmt::format("{}{}", counted(condition.damaged_blocks, "damaged block"),
                     condition.damaged_parity > 0 || condition.damaged_frame ? "; parity, too" : "");
}

bool is_of_another_file(const SurveyedParity& parity) {
  // Parity makes up for half of a file at most.
  return parity.file.is_beside() && parity.condition.damaged_blocks > parity.file.layout().blocks() / 4 * 3;
}

std::optional<SurveyedParity> survey_parity(const std::string& path, const RunOptions& run,
                                            const std::string& work) {
  std::optional<std::uint64_t> limit = run.memory;
  if (limit) *limit -= std::min(*limit, memory_of_declared_sources());
  const auto surveyed = [&](const ProtectedFile& file) {
    return SurveyedParity{file, file.survey(memory_for_stripes(limit, file.layout(), work))};
  };
  const auto found = protected_file(path);
  if (!found) return std::nullopt;
  SurveyedParity parity = surveyed(*found);
  const auto bytes = open_source(path);
  if (found->is_beside()) {
    if (parity.condition.is_repairable() && bytes->size() <= found->whole_size()) return parity;
    // Parity in the file, whose foot is damaged, may be of more help, and is then rebuilt itself.
    if (const auto inside = ProtectedFile::find(bytes))
      if (SurveyedParity other = surveyed(*inside); other.condition.is_repairable()) return other;
  } else if (!parity.condition.is_repairable() && is_regular_input(parity_beside(path))) {
    // Parity beside the file may bring back what that in it cannot, though not that itself.
    const auto file = beginning_of(bytes, std::min(found->layout().file_size, bytes->size()));
    const auto beside = ProtectedFile::find(file, std::make_shared<FileSource>(parity_beside(path)));
    if (beside && beside->is_beside())
      if (SurveyedParity other = surveyed(*beside);
          other.condition.is_repairable() && !other.condition.is_file_intact())
        return other;
  }
  return parity;
}

std::string why_not_repairable(const SurveyedParity& parity, const std::string& path) {
  const auto& [file, condition] = parity;
  if (is_of_another_file(parity))
    return fmt::format("is not repairable: {} is of another file, or nearly all is damaged",
                       parity_beside(path));
  if (condition.unknown_pages > 0)
    return fmt::format("is not repairable: too much of the description of its parity is lost ({})",
                       counted(condition.unknown_pages, "page"));
  std::uint64_t bytes = 0;
  for (const Stretch& stretch : condition.lost) bytes += stretch.end - stretch.begin;
  return fmt::format(
      "is not repairable: the damage exceeds what the parity can repair; {} bytes in {} are lost", bytes,
      counted(condition.lost.size(), "place"));
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
