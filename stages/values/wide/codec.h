// Codes the values of all voxels of one brick of uint32, int32, float32 or float64, each within a bound of
// the original, as bytes and back; voxels/codec.h does the same for the narrow types.
//
// Every sample becomes a number (numbers.h): an integer is its own number; a float becomes its key if nothing
// may be lost, and otherwise a fixed-point number. If numbers span less than 2^16, the coder of narrow
// samples codes them; others are coded closed loop in the same way. A float escapes if it is not
// finite, or if its number would not lead back to it within its bound: its bits are stored.
//
// In a file with a transform, narrow numbers are transformed. Other bricks keep half a step of it as their bound.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stages/bound/bounds.h"
#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/sample_type.h"
#include "stages/sample/status.h"
#include "stages/values/voxels/codec.h"

namespace tagrid {

using WideBrick = BrickOfVoxels<WideBounds>;

/// The rest of the code of a brick; see PendingVoxels.
struct [[nodiscard]] PendingWide {
  std::vector<std::uint16_t> numbers;  ///< of narrow samples, until the code is complete
  PendingVoxels<std::uint16_t> code;

  /// Numbers replace each other when they are coded: if they are stored, the reconstruction does not change.
  std::optional<std::size_t> finish(std::span<const std::uint8_t> to_carry = {}) {
    return code.finish(to_carry);
  }
};

/// Appends the coded values of a brick to `out`, except for what finish() appends; see encode_voxels(). A
/// sample that is not finite is restored bit by bit, whatever the bound.
template <class T>
PendingWide encode_voxels(std::span<const T> samples, const WideBrick& brick, std::span<T> reconstruction,
                          std::vector<std::uint8_t>& out);

/// The inverse. Safe on any bytes: see decode_voxels().
template <class T>
Status decode_voxels(std::span<const std::uint8_t> bytes, const WideBrick& brick, std::span<T> samples,
                     std::vector<std::uint8_t>& carried);

/// The peak of the heap that encode_voxels() takes for a box of `size` voxels, including the bytes that
/// it appends: the numbers of the samples, and with them either the numbers in another form, or the window,
/// the models and the largest possible number of events.
std::uint64_t working_bytes_of_encoding_wide_voxels(SampleType type, Index3 size, const WideBounds& bounds,
                                                    Effort effort, bool transformed = false);
/// The same for decode_voxels(): the window and the models.
std::uint64_t working_bytes_of_decoding_wide_voxels(SampleType type, Index3 size, Effort effort,
                                                    bool transformed = false);

/// Bricks whose numbers span less than 2^16 are coded as samples of 16 bits, as fast, in as few bytes and
/// with the same efforts. Most CT in wide types is of this kind. A sample is (low + n) * 2^exponent for a
/// number n < 2^16.
struct NarrowForm {
  int exponent = 0;  ///< 0 for integers
  std::int64_t low = 0;
  /// Bounds of the numbers, for inactive and for active voxels. At most 65535.
  std::array<std::int64_t, 2> errors{};
};

/// The form in which all samples keep their bounds, or nothing if there is none. `transform_step`: see
/// BrickOfVoxels; numbers are then far finer than it.
template <class T>
std::optional<NarrowForm> narrow_form(std::span<const T> samples, const WideBounds& bounds,
                                      double transform_step = 0);

/// Appends the coded values of a brick, without the byte that marks them as narrow; see encode_voxels().
template <class T>
PendingWide encode_narrow(std::span<const T> samples, const NarrowForm& form, const WideBrick& brick,
                          std::span<T> reconstruction, std::vector<std::uint8_t>& out);

/// The inverse. Safe on any bytes; see decode_voxels().
template <class T>
Status decode_narrow(std::span<const std::uint8_t> bytes, const WideBrick& brick, std::span<T> samples,
                     std::vector<std::uint8_t>& carried);

/// The peak of the heap that these take.
std::uint64_t working_bytes_of_encoding_narrow(Index3 size, Effort effort, bool transformed);
std::uint64_t working_bytes_of_decoding_narrow(Index3 size, Effort effort, bool transformed);

}  // namespace tagrid
