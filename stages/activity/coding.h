// The activity of the closed box of a brick, as bytes.
//
// Level by level, coarse to fine. A point can be active only if its parents are, so only points whose parents
// (those inside the box) are all active are coded: one adaptive binary event each, in the context of its
// class, its level, of what is known already of the points around it, and of the forecast where there is one.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/activity/forecast.h"
#include "stages/grid/lattice_bits.h"
#include "stages/volume/status.h"

namespace tagrid {

/// Appends the activity to `out`. REQUIRES: active.box() consists of whole root cubes, its root corners are
/// active, the set is closed under parents inside the box, no point has a level above `max_level`;
/// `forecast` is of the same box, or does not exist.
void encode_activity(const LatticeBits& active, const Forecast& forecast, int cube_size, int max_level,
                     std::vector<std::uint8_t>& out);

/// The inverse: sets the active points of `active`, whose box the caller has set, with the same forecast.
/// Safe on any bytes: the result is always closed under parents, and bytes that no encoder wrote are reported
/// where that can be seen.
Status decode_activity(std::span<const std::uint8_t> bytes, const Forecast& forecast, int cube_size,
                       int max_level, LatticeBits& active);

/// Heap that encode_activity() takes at its peak for a box of `size` points, the bytes that it appends
/// included: the models, two sets of bits, and an event for each point. `forecast`:
/// whether there is one.
std::uint64_t working_bytes_of_encoding_activity(Index3 size, int cube_size, bool forecast);
/// The same of decode_activity(), without the bits that it sets.
std::uint64_t working_bytes_of_decoding_activity(Index3 size, int cube_size, bool forecast);

}  // namespace tagrid
