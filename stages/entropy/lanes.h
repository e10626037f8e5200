// Sixteen numbers of 16 bits, processed together: as vectors of the compiler, which become the vector
// instructions of the machine's baseline, or one by one if TAGRID_SCALAR is defined. Both compute the same.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__) && !defined(TAGRID_SCALAR)
#include <emmintrin.h>
#endif

namespace tagrid {

inline constexpr std::size_t lane_count = 16;
using Lanes = std::array<std::int16_t, lane_count>;
/// Boundaries of sixteen intervals, ascending from 0; the last one, 65536, is stored as 0.
struct alignas(16) Boundaries : std::array<std::uint16_t, lane_count + 1> {};

#if !defined(TAGRID_SCALAR) && defined(__GNUC__)

namespace detail {
// Half of the lanes: as many as fit into the smallest vector registers.
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

/// (a + b) / 2 + c in every lane but the first, which is 0. REQUIRES: all lanes >= 0, and the results ascend.
inline Boundaries mean(const Lanes& a, const Lanes& b, const Lanes& c) {
  // Kept in a register: a store to one lane before the others are read again would take longer than all the
  // rest.
  constexpr detail::UnsignedHalf all_but_first = {0, 0xffff, 0xffff, 0xffff, 0xffff, 0xffff, 0xffff, 0xffff};
  Boundaries result;
  for (std::size_t first = 0; first < lane_count; first += detail::half) {
    auto sum =
        ((detail::load<detail::UnsignedHalf>(a, first) + detail::load<detail::UnsignedHalf>(b, first)) >> 1) +
        detail::load<detail::UnsignedHalf>(c, first);
    if (first == 0) sum &= all_but_first;
    std::memcpy(result.data() + first, &sum, sizeof sum);
  }
  result[lane_count] = 0;
  return result;
}

/// The index of the interval that contains `place`.
inline std::size_t interval_of(std::uint16_t place, const Boundaries& boundaries) {
  // Vector registers compare signed numbers only, so both sides are shifted by half of the range.
  const auto shifted = [&](std::size_t first) {
    return (detail::Half)(detail::load<detail::UnsignedHalf>(boundaries, first) ^ std::uint16_t{0x8000});
  };
  const auto bound = static_cast<std::int16_t>(place ^ 0x8000);
  const detail::Half above[2] = {shifted(0) > bound, shifted(detail::half) > bound};  // 0 or -1
#if defined(__SSE2__)
  // One bit per lane: the intervals after the wanted one.
  const __m128i bytes = _mm_packs_epi16((__m128i)above[0], (__m128i)above[1]);
  const auto after = static_cast<std::uint32_t>(_mm_movemask_epi8(bytes));
  return static_cast<std::size_t>(std::countr_zero(after | 1u << lane_count)) - 1;
#else
  std::array<std::uint64_t, 2> words;
  const detail::Half counts = -(above[0] + above[1]);
  std::memcpy(words.data(), &counts, sizeof counts);
  return lane_count - 1 - (((words[0] + words[1]) * 0x0001000100010001u) >> 48);
#endif
}

#else

inline void move_towards(Lanes& a, const Lanes& b, int shift) {
  for (std::size_t i = 0; i < lane_count; ++i)
    a[i] = static_cast<std::int16_t>(a[i] + ((b[i] - a[i]) >> shift));
}

inline Boundaries mean(const Lanes& a, const Lanes& b, const Lanes& c) {
  Boundaries result;
  for (std::size_t i = 0; i < lane_count; ++i)
    result[i] = static_cast<std::uint16_t>(((a[i] + b[i]) >> 1) + c[i]);
  result[0] = result[lane_count] = 0;
  return result;
}

inline std::size_t interval_of(std::uint16_t place, const Boundaries& boundaries) {
  std::size_t interval = 0;
  while (interval + 1 < lane_count && boundaries[interval + 1] <= place) ++interval;
  return interval;
}

#endif

}  // namespace tagrid
