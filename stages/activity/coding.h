// Codes the activity of the closed box of a brick as bytes.
//
// Goes level by level, coarse to fine. A point can be active only if its parents are, so only points whose
// parents inside the box are all active are coded. Each is one adaptive binary event. Its contexts
// (contexts.h) are the class of the point, the known activity around it, and the forecast, if there is one.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/activity/forecast.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/status.h"

namespace tagrid {

/// Appends the activity to `out`. REQUIRES: active.box() consists of complete root cubes; its root corners
/// are active; the set is closed under parents inside the box; no point has a level above `max_level`;
/// `forecast` belongs to the same box, or does not exist.
void encode_activity(const LatticeBits& active, const Forecast& forecast, int cube_size, int max_level,
                     std::vector<std::uint8_t>& out);

/// The inverse: sets the active points of `active`, whose box the caller has set, with the same forecast.
/// Safe on any bytes: the result is always closed under parents. Bytes that no encoder wrote are reported if
/// that can be detected.
Status decode_activity(std::span<const std::uint8_t> bytes, const Forecast& forecast, int cube_size,
                       int max_level, LatticeBits& active);

/// The same without a forecast. A program that calls nothing else has no code for one.
Status decode_activity(std::span<const std::uint8_t> bytes, int cube_size, int max_level,
                       LatticeBits& active);

/// The peak of the heap that encode_activity() takes for a box of `size` points, including the bytes that it
/// appends: the models, two sets of bits, and an event for each point. `forecast`: whether there is a
/// forecast.
std::uint64_t working_bytes_of_encoding_activity(Index3 size, bool forecast);
/// The same for decode_activity(), without the bits that it sets.
std::uint64_t working_bytes_of_decoding_activity(Index3 size, bool forecast);

}  // namespace tagrid
