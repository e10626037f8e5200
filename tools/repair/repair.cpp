#include "tools/repair/repair.h"

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/held_files.h"
#include "io/files/open_source.h"
#include "io/files/output_file.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/memory/parity.h"
#include "pipeline/run/run.h"

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

/// The blocks are those that were protected. The file's own checksums show that these were whole. `path`: where the file
/// is before it gets its name.
void prove(const std::string& input, const std::string& path, const RunOptions& run, const Ranks& ranks) {
  Ranks alone;
  try {
    ProgressMeter meter(run.progress, run.quiet, "verifying", 1);
    verify_file(alone, {.input = path, .resources = run.resources(ranks), .progress = meter.progress()});
  } catch (const BrokenInput& broken) {
    throw BrokenInput(
        "{}: is repaired to what was protected, but that is not a whole .tag file, and was not written "
        "({})",
        shown_input(input), broken.what());
  }
}

}  // namespace

bool repair_file(const SurveyedParity& parity, const UnchangedFiles& watched, const std::string& input,
                 const std::string& output, bool overwrite, const RunOptions& run, const Ranks& ranks) {
  OutputFile repaired(output, overwrite, {.like = attributes_of(input)});
  parity.file.repair(
      [&](std::uint64_t position, std::span<const std::byte> bytes) { repaired.write_at(position, bytes); },
      memory_for_stripes(run.memory, parity.file.layout(), "repairing a file"));
  const bool is_newer = needs_newer_program(repaired.temporary());
  if (!is_newer && parity.file.is_beside() && contradicts(input, repaired.temporary()))
    throw BrokenInput(
        "{}: what is intact by its own checksums is not what {} protects, which is of another file, or of "
        "an earlier one; remove it, or protect the file again",
        shown_input(input), parity_beside(input));
  if (!is_newer) prove(input, repaired.temporary(), run, ranks);
  const OutputLock lock(file_of_link(output));
  // Another run may have replaced it by a better one.
  watched.require();
  repaired.commit();
  return !is_newer;
}

}  // namespace tagrid
