// Sixteen numbers of 16 bits, worked on together: as vectors of the compiler, which become whatever vector
// instructions the machine's baseline has, or one by one where TAGRID_SCALAR is defined. Both compute the
// same.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace tagrid {

inline constexpr std::size_t lane_count = 16;
using Lanes = std::array<std::int16_t, lane_count>;
using UnsignedLanes = std::array<std::uint16_t, lane_count>;

#if !defined(TAGRID_SCALAR) && defined(__GNUC__)

namespace detail {
// Half of the lanes: as many as the smallest vector registers hold.
inline constexpr std::size_t half = lane_count / 2;
using Half = std::int16_t __attribute__((vector_size(2 * half)));
using UnsignedHalf = std::uint16_t __attribute__((vector_size(2 * half)));

template <class H, class L>
H load(const L& lanes, std::size_t first) {
  H vector;
  std::memcpy(&vector, lanes.data() + first, sizeof vector);
  return vector;
}
}  // namespace detail

/// a + ((b - a) >> shift) in every lane. REQUIRES: no difference overflows, 0 <= shift < 16.
inline void move_towards(Lanes& a, const Lanes& b, int shift) {
  for (std::size_t first = 0; first < lane_count; first += detail::half) {
    auto from = detail::load<detail::Half>(a, first);
    from += (detail::load<detail::Half>(b, first) - from) >> static_cast<std::int16_t>(shift);
    std::memcpy(a.data() + first, &from, sizeof from);
  }
}

/// (a + b) / 2 + c in every lane but the first, which is 0. REQUIRES: all lanes >= 0.
inline UnsignedLanes mean(const Lanes& a, const Lanes& b, const Lanes& c) {
  // In a register: a store to one lane before the others are read again would cost more than all the rest.
  constexpr detail::UnsignedHalf all_but_first = {0, 0xffff, 0xffff, 0xffff, 0xffff, 0xffff, 0xffff, 0xffff};
  UnsignedLanes result;
  for (std::size_t first = 0; first < lane_count; first += detail::half) {
    auto sum =
        ((detail::load<detail::UnsignedHalf>(a, first) + detail::load<detail::UnsignedHalf>(b, first)) >> 1) +
        detail::load<detail::UnsignedHalf>(c, first);
    if (first == 0) sum &= all_but_first;
    std::memcpy(result.data() + first, &sum, sizeof sum);
  }
  return result;
}

/// How many lanes are above `limit`.
inline std::size_t count_above(const UnsignedLanes& lanes, std::uint16_t limit) {
  // Vector registers compare signed numbers only: both sides are shifted by half of the range.
  const auto shifted = [&lanes](std::size_t first) {
    return (detail::Half)(detail::load<detail::UnsignedHalf>(lanes, first) ^ std::uint16_t{0x8000});
  };
  const auto bound = static_cast<std::int16_t>(limit ^ 0x8000);
  const detail::Half above = (shifted(0) > bound) + (shifted(detail::half) > bound);  // 0, -1 or -2
  std::array<std::uint64_t, 2> words;
  const detail::Half counts = -above;
  std::memcpy(words.data(), &counts, sizeof counts);
  return ((words[0] + words[1]) * 0x0001000100010001u) >> 48;
}

#else

inline void move_towards(Lanes& a, const Lanes& b, int shift) {
  for (std::size_t i = 0; i < lane_count; ++i)
    a[i] = static_cast<std::int16_t>(a[i] + ((b[i] - a[i]) >> shift));
}

inline UnsignedLanes mean(const Lanes& a, const Lanes& b, const Lanes& c) {
  UnsignedLanes result;
  for (std::size_t i = 0; i < lane_count; ++i)
    result[i] = static_cast<std::uint16_t>(((a[i] + b[i]) >> 1) + c[i]);
  result[0] = 0;
  return result;
}

inline std::size_t count_above(const UnsignedLanes& lanes, std::uint16_t limit) {
  std::size_t count = 0;
  for (const std::uint16_t lane : lanes) count += lane > limit;
  return count;
}

#endif

}  // namespace tagrid
