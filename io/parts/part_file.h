// A part of a .tag file in a separate file: its blocks as they will be in the entire file, and the data that
// is needed to place them there. docs/dev/design.md explains its purpose. Byte by byte (all little endian):
//
//   head    "TAGPART\n", the run (8), the part's number (8), its first brick (8), bricks (8), checksum (8)
//   blocks  as in the .tag file, but each ends in its own checksum
//   table   of every brick: bytes of activity (4) and values (4), own checksum (8), statistics
//   tail    bytes before the table (8), checksum of head, table and that number (8), "TAGDONE\n"
//
// These files live as long as a run, and only the program that wrote them reads them: the format may change
// with every version.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "io/bytes/checksum.h"
#include "io/files/file_bytes.h"
#include "io/files/output_file.h"
#include "io/tag/blocks.h"

namespace tagrid {

/// The identity of a part file.
struct PartId {
  std::uint64_t run = 0;  ///< see RunRecord::id
  std::int64_t number = 0;
  std::int64_t first_brick = 0, bricks = 0;
  std::uint64_t sums_bytes = 0;  ///< of sums of blocks for overviews
};

class PartWriter : public BrickSink {
 public:
  /// A file at `path`, which gets this name when it is complete.
  PartWriter(const std::string& path, const PartId& id, const CodingParameters& parameters);
  /// REQUIRES: the bricks of the part come in the order of their numbers.
  void write_brick(const BrickBytes& brick, const Statistics& statistics) override;
  /// The next bytes of the part's sums. REQUIRES: all bricks were written.
  void write_sums(std::span<const std::byte> bytes);
  /// Completes the file, makes it durable and gives it its name. REQUIRES: all sums were written.
  void finish();

 private:
  OutputFile out_;
  CodingParameters parameters_;
  std::vector<std::byte> head_, table_;
  RunningChecksum sums_;
};

struct PartEntry {
  std::uint32_t activity_bytes = 0, value_bytes = 0;
  std::uint64_t own_checksum = 0;
  Statistics statistics;

  std::uint64_t block_bytes() const { return block_frame_size + std::uint64_t{activity_bytes} + value_bytes; }
};

/// Reads a part file. Wrong bytes, another part or another run throw BrokenInput.
class PartReader {
 public:
  /// Reads everything except the blocks.
  PartReader(const std::string& path, const PartId& id, const CodingParameters& parameters);

  const std::vector<PartEntry>& table() const { return table_; }
  /// Bytes of all blocks.
  std::uint64_t blocks_size() const { return blocks_size_; }
  /// Reads and checks the next block. REQUIRES: there is one.
  void read_block(std::vector<std::byte>& block);
  /// Passes the sums, part by part, of `at_once` bytes but for the last one, and then checks them.
  void read_sums(std::size_t at_once, const std::function<void(std::span<const std::byte>)>& use);

 private:
  [[noreturn]] void fail(const std::string& what) const;
  void read_exactly(std::byte* out, std::size_t size);
  void read_table(const PartId& id, const CodingParameters& parameters);

  FileBytes bytes_;
  std::int64_t first_brick_ = 0;
  std::size_t next_block_ = 0;
  std::vector<PartEntry> table_;
  std::uint64_t blocks_size_ = 0, sums_bytes_ = 0;
};

}  // namespace tagrid
