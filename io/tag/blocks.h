// The pieces of a .tag file behind its header: blocks of bricks, then index and footer. docs/format.md
// specifies every byte.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "io/files/output_file.h"
#include "io/tag/index.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {

/// The bytes of one brick.
struct BrickBytes {
  std::int64_t id = 0;
  std::vector<std::uint8_t> activity;
  std::vector<std::uint8_t> values;
};

/// Bytes of a block besides activity and values: length, number, length of the activity, checksum.
inline constexpr std::uint64_t block_frame_size = 4 + 8 + 4 + 8;

/// Largest length (the first field of a block) that a brick of a true file has: a byte for a point's
/// activity, and twice a sample. The coders stay far below.
std::uint64_t largest_body(const CodingParameters& parameters, std::int64_t brick);

/// Length, number and length of the activity: the fields before the activity.
std::vector<std::byte> block_head(const CodingParameters& parameters, const BrickBytes& brick);
/// The checksum of a block's fields from the length to the values, which does not depend on what precedes it.
std::uint64_t own_checksum(const std::vector<std::byte>& head, const BrickBytes& brick);
/// Writes a block that ends in `checksum`.
void write_block(OutputFile& out, const std::vector<std::byte>& head, const BrickBytes& brick,
                 std::uint64_t checksum);

inline constexpr std::array<std::uint8_t, 8> end_magic = {'T', 'A', 'G', ' ', 'E', 'N', 'D', '\n'};

/// Index and footer of a file whose blocks end at byte `start`, the last one in `last_checksum`.
std::vector<std::byte> file_end(const CodingParameters& parameters, const TagIndex& index,
                                std::uint64_t start, std::uint64_t last_checksum,
                                std::uint64_t header_checksum);

}  // namespace tagrid
