// The parts of a .tag file after its header: blocks, index and footer. docs/dev/format.md specifies every byte.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/byte_sink.h"
#include "io/parity/layout.h"
#include "io/tag/index.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/status.h"

namespace tagrid {

/// The bytes of one brick.
struct BrickBytes {
  std::int64_t id = 0;
  std::vector<std::uint8_t> activity;
  std::vector<std::uint8_t> values;
};

/// Takes the bricks of a file, or of a part of one, in the order of their numbers.
class BrickSink {
 public:
  virtual ~BrickSink() = default;
  virtual void write_brick(const BrickBytes& brick, const Statistics& statistics) = 0;
};

/// Gives the bricks of a file in the order of their numbers, however the file is read.
class BrickSource {
 public:
  virtual ~BrickSource() = default;
  virtual const std::string& name() const = 0;  ///< of the file, for messages
  /// Reads the next brick, or returns false after the last one. Never called by two threads at once.
  virtual bool read_brick(BrickBytes& brick) = 0;
  /// No more bricks are wanted. Another thread may call this during read_brick(), which then throws instead
  /// of waiting.
  virtual void stop() {}
};

/// Bytes of a block before the activity: its length, and the length of the activity.
inline constexpr std::uint32_t block_head_size = 4 + 4;
/// Bytes of a block besides activity and values: that head and the checksum.
inline constexpr std::uint64_t block_frame_size = block_head_size + 8;

/// Largest length (the first field of a block) that a brick of a valid file has: one byte per point for the
/// activity, and twice the size of its samples. The coders stay far below.
std::uint64_t largest_body(const CodingParameters& parameters, std::int64_t brick);

/// The checksum of a brick's number and a block's fields from the length to the values, which does not depend
/// on what precedes it.
std::uint64_t own_checksum(std::span<const std::byte> fields, std::int64_t brick);
/// Writes a block, and returns the checksum at its end: its own, chained with the one `before` it if given.
std::uint64_t write_block(ByteSink& out, const CodingParameters& parameters, const BrickBytes& brick,
                          std::optional<std::uint64_t> before = std::nullopt);

/// Reads a block, from its length to its checksum; it must be that of brick `id`. `checksum` holds the
/// checksum before the block, and receives that of the block.
Status parse_block(std::span<const std::byte> block, const CodingParameters& parameters, std::int64_t id,
                   std::uint64_t& checksum, BrickBytes& brick);

/// Reads a block as above, with the checksum before it in front; the index says that its activity has so many
/// bytes.
Status parse_bound_block(std::span<const std::byte> bytes, const CodingParameters& parameters,
                         std::int64_t id, std::uint64_t activity_bytes, BrickBytes& brick);

/// Takes a block apart whose length is possible, and whose checksum is known to be right.
Status split_block(std::span<const std::byte> block, std::int64_t id, BrickBytes& brick);

/// Bytes of a packed block before its compressed part: its marker and two sizes. The envelope and the pages of
/// the index are such blocks.
inline constexpr std::size_t packed_head_size = 4 + 4 + 4;
/// Bytes of a packed block besides its compressed part: that head and the checksum.
inline constexpr std::size_t packed_frame_size = packed_head_size + 8;

/// How many bytes a packed block may hold, before they are compressed.
struct ContentSize {
  std::uint64_t least = 0, most = 0;
};
/// The most bytes that `size` bytes take when they are compressed.
constexpr std::uint64_t largest_packed(std::uint64_t size) { return size + size / 128 + 1024; }

/// A block with `content`. `checksum` is the one before it, and receives that of the block.
std::vector<std::byte> packed_block(std::uint32_t marker, std::span<const std::byte> content,
                                    std::uint64_t& checksum);
/// Reads the first packed_head_size bytes of a block. `rest` receives the number of bytes that follow.
Status parse_packed_head(std::span<const std::byte> head, std::uint32_t marker, ContentSize possible,
                         std::uint64_t& rest);
/// The checksum that an entire block, whose head was checked, has after the block with the checksum `before`.
std::uint64_t packed_checksum(std::span<const std::byte> block, std::uint64_t before);
/// Reads an entire block, whose head was checked. `content` may be null: then only the checksum is read and
/// checked.
Status parse_packed_block(std::span<const std::byte> block, std::uint64_t& checksum,
                          std::vector<std::byte>* content);

/// The first field of a block of the envelope, where a brick has its length, which is never 1.
inline constexpr std::uint32_t envelope_marker = 1;
/// The most bytes that a block of the envelope holds, before they are compressed.
inline constexpr std::size_t largest_envelope_block = std::size_t{1} << 20;
/// What such a block may hold.
inline constexpr ContentSize envelope_content = {1, largest_envelope_block};

/// Cuts the bytes of an envelope into blocks.
class EnvelopeBlocks {
 public:
  /// `checksum` is that of the last block of the file; it is continued. Both arguments must outlive this object.
  EnvelopeBlocks(std::uint64_t& checksum, ByteSink& out) : checksum_(checksum), out_(out) {}

  void write(std::span<const std::byte> bytes);
  /// Makes a block of what is left.
  void finish();

 private:
  std::uint64_t& checksum_;
  ByteSink& out_;
  std::vector<std::byte> waiting_;
};

inline constexpr std::array<std::uint8_t, 8> end_magic = {'T', 'A', 'G', ' ', 'E', 'N', 'D', '\n'};

/// Directory of the index and footer of a file whose blocks, those of pages and the envelope included, end at
/// byte `start`; `last_checksum` is that of the last block.
std::vector<std::byte> file_end(const CodingParameters& parameters, const TagIndex& index,
                                std::uint64_t start, std::uint64_t last_checksum,
                                std::uint64_t header_checksum);

/// Bytes of the footer: position of the index, the header's checksum, end_magic.
inline constexpr std::size_t footer_size = 8 + 8 + end_magic.size();
/// Bytes of the directory before its compressed part: a length of 0 where a brick has its own, and two sizes.
inline constexpr std::size_t index_head_size = 4 + 8 + 8;
/// The checksum before a directory, the directory and the footer are within so many bytes from the end.
inline constexpr std::uint64_t largest_end = 1 << 18;
static_assert(8 + index_head_size + largest_packed(largest_directory) + 8 + footer_size <= largest_end);

/// Finds the beginning of the index from the footer. Broken if `footer` is not a footer.
Status find_file_end(std::span<const std::byte> footer, std::uint64_t& start);

/// The facts about a file that are needed to read its index and footer.
struct FileEnd {
  const CodingParameters& parameters;
  std::uint64_t header_size, header_checksum;
  std::uint64_t start;          ///< position where the blocks end and the directory begins
  std::uint64_t last_checksum;  ///< of the last block
  int volumes = 1;              ///< in the file

  /// Reads the first index_head_size bytes. `rest` receives the number of bytes to the file's end.
  Status parse_head(std::span<const std::byte> head, std::uint64_t& rest) const;
  /// Reads all of it, from the directory's first byte to the file's last.
  /// `envelope` receives the size of the envelope, which lies between the last page and the members or the
  /// directory.
  Status parse(std::span<const std::byte> bytes, TagIndex& index, std::uint64_t& envelope) const;

 private:
  Status check_sizes(const PageLayout& layout, const TagIndex& index, std::uint64_t& envelope) const;
};

/// The sizes of the parts of a file; they sum to the size of the file.
struct TagSizes {
  std::uint64_t file = 0, header = 0, activity = 0, values = 0;
  std::uint64_t envelope = 0;
  std::uint64_t members = 0;  ///< with their frames
  std::uint64_t index = 0;    ///< the pages and the directory, the footer, and the frames of the bricks
  std::uint64_t parity = 0;
};
TagSizes tag_sizes(std::uint64_t file, std::uint64_t header, std::uint64_t envelope, const TagIndex& index);
/// The sizes of a file that is followed by parity, if there is any.
inline TagSizes with_parity(TagSizes sizes, const std::optional<ParityLayout>& parity) {
  if (parity) sizes.parity = parity->end(sizes.file) - sizes.file;
  sizes.file += sizes.parity;
  return sizes;
}

/// For the place at which the footer should be. A reader that begins at the end cannot tell a damaged file
/// from a complete one that is followed by other bytes.
inline constexpr const char* no_footer =
    "the file does not end with a footer: it is truncated or damaged, was never finished, or has extra bytes "
    "after its end";
/// For a reader that has read the complete file before.
inline constexpr const char* bytes_follow = "there are extra bytes after the end of the file";

/// The error of a part of the file, which was found before a byte.
BrokenInput broken_part(const std::string& file, const std::string& part, std::uint64_t before,
                        const std::string& what);
BrokenInput broken_part(const std::string& file, const std::string& part, std::uint64_t before,
                        const Status& status);

}  // namespace tagrid
