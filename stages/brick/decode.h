// Decodes one brick of any sample type from its bytes. The type of the samples is chosen here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/status.h"

namespace tagrid {

/// A decoded brick. Samples are stored as in memory, in the type of the volume, x fastest.
struct DecodedBrick {
  std::int64_t id = 0;
  LatticeBits active;              ///< activity of its closed box; empty in a file that stores no grid
  std::vector<std::byte> samples;  ///< the samples that it owns, or those of its first slices
  std::vector<std::byte> points;   ///< in a file without voxels: see BrickValues
};

/// Which parts of a brick are needed.
enum class Wanted {
  samples,           ///< only samples
  samples_and_grid,  ///< also the active points and the values of points
};

inline constexpr std::int64_t all_slices = std::numeric_limits<std::int64_t>::max();

/// What is asked of a brick.
struct BrickRequest {
  std::int64_t id = 0;  ///< its number
  Wanted wanted = Wanted::samples_and_grid;
  /// Values lie slice after slice: if only the first slices across z are needed, the time for the others is
  /// saved, and their code is not checked. A brick that has fewer, or no values of voxels, is decoded as a
  /// whole. REQUIRES: at least one; all of them with Wanted::samples_and_grid.
  std::int64_t slices = all_slices;
};

/// The bytes of a brick; see BrickCode.
struct BrickCodeView {
  std::span<const std::uint8_t> activity, values;
};

/// Decodes a brick. Safe on any bytes.
Status decode_brick(BrickCodeView code, const CodingParameters& parameters, BrickRequest request,
                    DecodedBrick& brick);

/// The peak of the heap that decode_brick() takes, including the decoded brick.
std::uint64_t working_bytes_of_decoding(const CodingParameters& parameters, Index3 brick, Wanted wanted);

}  // namespace tagrid
