// Codes labels: numbers of which neighbours are equal or not, and whose order means nothing. Most voxels have the
// label of one before them; where all neighbours agree, whole runs are one event.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/sample/status.h"

namespace tagrid {

/// Appends the coded labels of a box of `size`, x fastest. Returns false, and appends nothing, if they take
/// more than an event for each: they are not what this is for. REQUIRES: labels below `count`, which is
/// 2 .. 65536.
bool append_labels(std::span<const std::uint16_t> labels, Index3 size, std::uint32_t count,
                   std::vector<std::uint8_t>& out);

/// The inverse. Safe on any bytes: labels are below `count`. `labels`: those of the first slices.
Status decode_labels(std::span<const std::uint8_t> bytes, Index3 size, std::uint32_t count,
                     std::span<std::uint16_t> labels);

/// The heap that these take, with the bytes that are appended.
std::uint64_t working_bytes_of_encoding_labels(Index3 size);
std::uint64_t working_bytes_of_decoding_labels(Index3 size);

}  // namespace tagrid
