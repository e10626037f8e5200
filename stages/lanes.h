// Sixteen numbers of 16 bits as one value: vectors of the compiler, which become whatever vector instructions
// the machine's baseline has, or plain arrays where TAGRID_SCALAR is defined. Both compute the same.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace tagrid {

inline constexpr std::size_t lane_count = 16;

#if !defined(TAGRID_SCALAR) && defined(__GNUC__)

using Lanes = std::int16_t __attribute__((vector_size(2 * lane_count)));
using UnsignedLanes = std::uint16_t __attribute__((vector_size(2 * lane_count)));

/// a + ((b - a) >> shift) in every lane. REQUIRES: all lanes >= 0, 0 <= shift < 16.
inline void move_towards(Lanes& a, const Lanes& b, int shift) {
  a += (b - a) >> static_cast<std::int16_t>(shift);
}

/// (a + b) / 2 + c in every lane. REQUIRES: all lanes >= 0.
inline void mean(const Lanes& a, const Lanes& b, const Lanes& c, UnsignedLanes& result) {
  result = (((UnsignedLanes)a + (UnsignedLanes)b) >> 1) + (UnsignedLanes)c;
}

/// How many lanes are not above `limit`.
inline std::size_t count_up_to(const UnsignedLanes& lanes, std::uint16_t limit) {
  using Half = std::uint16_t __attribute__((vector_size(lane_count)));
  const auto one = (UnsignedLanes)(lanes <= limit) >> 15;
  const auto halves = std::bit_cast<std::array<Half, 2>>(one);
  const auto quarters = std::bit_cast<std::array<std::uint64_t, 2>>(halves[0] + halves[1]);
  return ((quarters[0] + quarters[1]) * 0x0001000100010001u) >> 48;
}

#else

using Lanes = std::array<std::int16_t, lane_count>;
using UnsignedLanes = std::array<std::uint16_t, lane_count>;

inline void move_towards(Lanes& a, const Lanes& b, int shift) {
  for (std::size_t i = 0; i < lane_count; ++i)
    a[i] = static_cast<std::int16_t>(a[i] + ((b[i] - a[i]) >> shift));
}

inline void mean(const Lanes& a, const Lanes& b, const Lanes& c, UnsignedLanes& result) {
  for (std::size_t i = 0; i < lane_count; ++i)
    result[i] = static_cast<std::uint16_t>(((a[i] + b[i]) >> 1) + c[i]);
}

inline std::size_t count_up_to(const UnsignedLanes& lanes, std::uint16_t limit) {
  std::size_t count = 0;
  for (const std::uint16_t lane : lanes) count += lane <= limit;
  return count;
}

#endif

}  // namespace tagrid
