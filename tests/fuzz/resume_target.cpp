// The files that a continued run finds from the run before: its record, and its parts.
#include <algorithm>
#include <vector>

#include "io/errors/errors.h"
#include "io/parts/part_file.h"
#include "io/parts/run_record.h"
#include "tests/fuzz/memory_files.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {

void record(Bytes bytes) {
  RunRecord record;
  if (!parse_record(std::as_bytes(bytes), record).ok()) return;
  const std::vector<std::byte> again = serialize_record(record);
  const auto content = std::as_bytes(bytes).first(bytes.size() - 8);  // its checksum follows
  claim(std::equal(content.begin(), content.end(), again.begin(), again.end() - 8),
        "a record is written as it was");
}

void part(Bytes bytes) {
  try {
    PartReader reader(MemoryFile(bytes).path(), seed_part, seed_part_parameters());
    claim(reader.table().size() == seed_part.bricks, "a part has all its bricks");
    std::vector<std::byte> block;
    std::uint64_t size = 0;
    for (const PartEntry& entry : reader.table()) {
      reader.read_block(block);
      claim(block.size() == entry.block_bytes(), "a block is as large as the table says");
      size += block.size();
    }
    claim(size == reader.blocks_size() && size < bytes.size(), "blocks fill what they are said to fill");
  } catch (const BrokenInput&) {
  }
}

}  // namespace tagrid::fuzz
