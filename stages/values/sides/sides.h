// Keeps decoded samples on their side of thresholds. The bound E of a sample allows that it crosses a threshold less
// than E away: for these samples, one adaptive bit each says whether they did. One that did becomes the value next to
// the threshold, on its own side, which is nearer to the original.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/sample/status.h"
#include "stages/sample/thresholds.h"

namespace tagrid {

/// Moves decoded samples to the sides of the original ones, and appends what a decoder needs for that: nothing if
/// none is on another side. Adds the numbers of samples that were moved to `moved`. Decoded samples that are not
/// finite are those of the original. REQUIRES: thresholds are samples of T, increasing, and above the lowest one.
template <class T>
void encode_sides(std::span<const T> original, const Thresholds& thresholds, std::span<T> decoded,
                  OfThresholds<std::uint64_t>& moved, std::vector<std::uint8_t>& out);

/// Moves decoded samples of a brick in the same way: all of them, or the first ones. Safe on any bytes.
template <class T>
Status decode_sides(std::span<const std::uint8_t> bytes, const Thresholds& thresholds, bool are_all,
                    std::span<T> decoded);

/// The peak of the heap that encode_sides() takes for so many samples. decode_sides() takes next to none.
std::uint64_t working_bytes_of_sides(std::uint64_t samples, std::size_t thresholds);

}  // namespace tagrid
