// Bricks of wide samples that are narrow: their numbers span less than 2^16, so they are coded as samples of
// 16 bits, as fast, in as few bytes and with the same efforts. Most CT in wide types is of this kind.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/status.h"
#include "stages/values/wide/codec.h"

namespace tagrid {

/// A sample is (low + n) * 2^exponent for a number n < 2^16.
struct NarrowForm {
  int exponent = 0;  ///< 0 for integers
  std::int64_t low = 0;
  /// Bounds of the numbers, for inactive and for active voxels. At most 65535.
  std::array<std::int64_t, 2> errors{};
};

/// The form in which all samples keep their bounds, or nothing if there is none.
template <class T>
std::optional<NarrowForm> narrow_form(std::span<const T> samples, const WideBounds& bounds);

/// Appends the coded values of a brick, without the byte that marks them as narrow; see encode_voxels().
template <class T>
PendingWide encode_narrow(std::span<const T> samples, const NarrowForm& form, const WideBrick& brick,
                          std::span<T> reconstruction, std::vector<std::uint8_t>& out);

/// The inverse. Safe on any bytes; see decode_voxels().
template <class T>
Status decode_narrow(std::span<const std::uint8_t> bytes, const WideBrick& brick, std::span<T> samples,
                     std::vector<std::uint8_t>& carried);

/// The peak of the heap that these take.
std::uint64_t working_bytes_of_encoding_narrow(Index3 size, Effort effort);
std::uint64_t working_bytes_of_decoding_narrow(Index3 size, Effort effort);

}  // namespace tagrid
