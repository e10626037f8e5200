// The first byte of the values of a brick of voxels, of any type: whether the brick is constant or coded.
// Bricks that are not coded.
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "stages/entropy/rans_coder.h"
#include "stages/grid/box.h"
#include "stages/sample/numbers.h"
#include "stages/sample/status.h"

namespace tagrid {

inline constexpr std::uint8_t constant_brick = 0, coded_brick = 1, raw_brick = 3, transformed_brick = 9;

/// The number of slices that `samples` values, the first ones of a brick, fill.
/// REQUIRES: at least one slice; complete ones; not more than the brick has.
inline std::int64_t slices_in(const Box& owned, std::size_t samples) {
  const Index3 size = owned.size();
  const std::int64_t slices = static_cast<std::int64_t>(samples) / (size.x * size.y);
  assert(slices > 0 && slices <= size.z && static_cast<std::size_t>(slices * size.x * size.y) == samples);
  return slices;
}

/// Appends the values of a brick whose samples are all decoded as `value`.
template <class T>
void append_constant_brick(T value, std::vector<std::uint8_t>& out) {
  out.push_back(constant_brick);
  if constexpr (std::is_floating_point_v<T>)
    append_bytes(bits_of(value), sizeof(T), out);
  else
    append_bytes(static_cast<std::uint64_t>(value), sizeof(T), out);
}

/// Appends the samples as they are: for noise, which would take more room if it was coded.
template <class T>
void append_raw_brick(std::span<const T> samples, std::vector<std::uint8_t>& out) {
  out.push_back(raw_brick);
  for (const T sample : samples) append_bytes(static_cast<std::uint64_t>(sample), sizeof(T), out);
}

/// The inverse, for bytes that begin with raw_brick. `samples`: the first ones of a brick of `count`.
template <class T>
Status decode_raw_brick(std::span<const std::uint8_t> bytes, std::size_t count, std::span<T> samples) {
  if (bytes.size() != 1 + count * sizeof(T))
    return Status::broken("values of a raw brick have the wrong size");
  const std::uint8_t* at = bytes.data() + 1;
  for (T& sample : samples) {
    std::uint32_t bits = 0;
    for (std::size_t byte = 0; byte < sizeof(T); ++byte) bits |= std::uint32_t{*at++} << (8 * byte);
    sample = static_cast<T>(bits);
  }
  return {};
}

/// Sets the samples of a constant brick. For other bricks it calls `decode`, a function of a RansDecoder that
/// sets the samples and returns a Status. `samples`: the first ones of a brick of `count`. Safe on any bytes.
template <class T, class Decode>
Status decode_brick_values(std::span<const std::uint8_t> bytes, std::size_t count, std::span<T> samples,
                           Decode decode) {
  if (bytes.empty()) return Status::broken("values are missing");
  if (bytes[0] == constant_brick) {
    if (bytes.size() != 1 + sizeof(T))
      return Status::broken("values of a constant brick have the wrong size");
    const std::uint64_t bits = number_in(bytes.subspan(1));
    T value;
    if constexpr (std::is_floating_point_v<T>)
      value = std::bit_cast<T>(static_cast<BitsOf<T>>(bits));
    else
      value = static_cast<T>(bits);
    std::fill(samples.begin(), samples.end(), value);
    return {};
  }
  if (bytes[0] != coded_brick) return Status::newer("values of an unknown kind");
  RansDecoder coder(bytes.subspan(1));
  if (Status status = decode(coder); !status.ok()) return status;
  if (coder.exhausted()) return Status::broken("values end too soon");
  if (samples.size() == count && !coder.finished())
    return Status::broken("values are followed by other bytes");
  return {};
}

}  // namespace tagrid
