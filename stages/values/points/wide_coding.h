// Codes the values of the active points of a brick of wide samples as bytes; coding.h does the same for the
// narrow types.
//
// Integers are stored as multiples of 2 E_n + 1, clamped to the type. Floats are stored as multiples of 2
// E_n, rounded to the type, if these are within E_n, and otherwise as they are. If E_n = 0, every value is
// stored as it is. All of this depends on the value alone, so both bricks at a shared face store the same.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/lattice_bits.h"
#include "stages/sample/sample_type.h"
#include "stages/sample/status.h"

namespace tagrid {

/// The stored value for `value`, if points may be wrong by `point_error`. Values that are not finite stay as
/// they are.
template <class T>
T stored_wide_point(T value, double point_error);

/// Appends the values of the active points of active.box(); see encode_points().
template <class T>
void encode_wide_points(std::span<const T> values, const LatticeBits& active, int cube_size,
                        double point_error, std::vector<std::uint8_t>& out);

/// The inverse: sets the values of the active points. Safe on any bytes.
template <class T>
Status decode_wide_points(std::span<const std::uint8_t> bytes, const LatticeBits& active, int cube_size,
                          double point_error, std::span<T> values);

/// The peak of the heap that encode_wide_points() takes for a box of `size` points, including the bytes that
/// it appends: the numbers of the points, the models, and the largest possible number of events.
std::uint64_t working_bytes_of_encoding_wide_points(SampleType type, Index3 size);
/// The same for decode_wide_points(): the numbers and the models.
std::uint64_t working_bytes_of_decoding_wide_points(Index3 size);

}  // namespace tagrid
