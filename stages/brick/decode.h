// Decodes one brick of any sample type from its bytes. The type of the samples is chosen here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "stages/grid/lattice_bits.h"
#include "stages/volume/coding_parameters.h"
#include "stages/volume/status.h"

namespace tagrid {

/// A decoded brick. Samples are stored as in memory, in the type of the volume, x fastest.
struct DecodedBrick {
  std::int64_t id = 0;
  LatticeBits active;              ///< activity of its closed box; empty in a file that stores no grid
  std::vector<std::byte> samples;  ///< the samples that it owns, or those of its first slices
  std::vector<std::byte> points;   ///< in a file without voxels: see decode_brick_values()
};

/// Which parts of a brick are needed.
enum class Wanted {
  samples,           ///< only samples
  samples_and_grid,  ///< also the active points and the values of points
};

inline constexpr std::int64_t all_slices = std::numeric_limits<std::int64_t>::max();

/// Decodes brick `id` from the bytes of its activity and its values. Safe for any bytes. Values lie slice after slice: if only
/// the first `slices` slices across z are needed, the time for the others is saved, and their code is not checked. A brick
/// that has fewer, or no values of voxels, is decoded as a whole.
/// REQUIRES: slices > 0; with Wanted::samples_and_grid, all slices.
Status decode_brick(std::span<const std::uint8_t> activity, std::span<const std::uint8_t> values,
                    const CodingParameters& parameters, std::int64_t id, Wanted wanted, DecodedBrick& brick,
                    std::int64_t slices = all_slices);

/// The peak of the heap that decode_brick() takes, including the decoded brick.
std::uint64_t working_bytes_of_decoding(const CodingParameters& parameters, Index3 brick, Wanted wanted);

}  // namespace tagrid
