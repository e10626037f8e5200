// Bricks whose values are few (stages/values/few): the bytes of a brick of any type say what numbers mean, and the
// numbers follow, as a brick of uint16 or as labels.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "stages/sample/sample_type.h"
#include "stages/sample/status.h"
#include "stages/values/voxels/codec.h"

namespace tagrid {

/// The rest of the code of numbers.
template <class T>
using PendingFew = PendingVoxels<std::conditional_t<is_wide<T>, std::uint16_t, T>>;

/// Appends the coded values of a brick, except for what finish() appends, if the values are few. `low`, `high`:
/// the range of samples of 8 or 16 bits; see find_few(). Otherwise as encode_voxels().
template <class T, class Bounds>
std::optional<PendingFew<T>> encode_few(std::span<const T> samples, const BrickOfVoxels<Bounds>& brick, T low,
                                        T high, std::span<T> reconstruction, std::vector<std::uint8_t>& out);

/// True if the bytes of a brick say that its values are few.
bool is_few_brick(std::span<const std::uint8_t> bytes);

/// The inverse of encode_few(). Safe on any bytes: see decode_voxels(). REQUIRES: is_few_brick(bytes).
template <class T, class Bounds>
Status decode_few(std::span<const std::uint8_t> bytes, const BrickOfVoxels<Bounds>& brick,
                  std::span<T> samples, std::vector<std::uint8_t>& carried);

/// The peak of the heap that a brick takes which may be one of these. `as_it_is`: what coding of the numbers, or
/// of the samples, takes.
std::uint64_t working_bytes_of_encoding_few(SampleType type, Index3 size, std::uint64_t as_it_is);
std::uint64_t working_bytes_of_decoding_few(SampleType type, Index3 size, std::uint64_t as_it_is);
/// What remains while a code is pending.
std::uint64_t working_bytes_of_numbers(SampleType type, Index3 size);

}  // namespace tagrid
