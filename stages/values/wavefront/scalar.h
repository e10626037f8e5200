// Sixteen lanes as arrays, for machines without the vector instructions of vectors.h: the same functions, as loops.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

template <class T>
struct Sixteen {
  T v[16];
};
struct I16 : Sixteen<std::int16_t> {};
struct I32 : Sixteen<std::int32_t> {};
struct F32 : Sixteen<float> {};
struct M16 {
  std::uint32_t bits;
};
struct M32 {
  std::uint32_t bits;
};

/// A lane of the result for each lane.
template <class R, class Operation>
inline R each(Operation operation) {
  R r;
  for (int i = 0; i < 16; ++i) r.v[i] = static_cast<std::decay_t<decltype(r.v[0])>>(operation(i));
  return r;
}
template <class M, class Condition>
inline M where(Condition condition) {
  std::uint32_t bits = 0;
  for (int i = 0; i < 16; ++i) bits |= std::uint32_t{condition(i)} << i;
  return {bits};
}
inline std::int32_t wrapped(std::int64_t a) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a));
}

// ---- Lanes of 16 bits
inline I16 load16(const void* from) {
  I16 r;
  std::memcpy(r.v, from, sizeof r.v);
  return r;
}
inline void store(const I16& a, void* to) { std::memcpy(to, a.v, sizeof a.v); }
inline I16 set16(int value) {
  return each<I16>([&](int) { return value; });
}
inline I16 operator+(const I16& a, const I16& b) {
  return each<I16>([&](int i) { return a.v[i] + b.v[i]; });
}
inline I16 operator-(const I16& a, const I16& b) {
  return each<I16>([&](int i) { return a.v[i] - b.v[i]; });
}
inline I16 operator*(const I16& a, const I16& b) {
  return each<I16>([&](int i) { return a.v[i] * b.v[i]; });
}
inline I16 max(const I16& a, const I16& b) {
  return each<I16>([&](int i) { return std::max(a.v[i], b.v[i]); });
}
inline I16 min(const I16& a, const I16& b) {
  return each<I16>([&](int i) { return std::min(a.v[i], b.v[i]); });
}
inline I16 mul_high(const I16& a, const I16& b) {
  return each<I16>([&](int i) { return (a.v[i] * b.v[i]) >> 16; });
}
template <int bits>
inline I16 shift_left(const I16& a) {
  return each<I16>([&](int i) { return a.v[i] * (1 << bits); });
}
inline M16 operator==(const I16& a, const I16& b) {
  return where<M16>([&](int i) { return a.v[i] == b.v[i]; });
}
inline M16 not_above(const I16& a, const I16& b) {
  return where<M16>(
      [&](int i) { return static_cast<std::uint16_t>(a.v[i]) <= static_cast<std::uint16_t>(b.v[i]); });
}
inline M16 operator&(M16 a, M16 b) { return {a.bits & b.bits}; }
inline I16 next_lane(const I16& a, std::int16_t first) {
  return each<I16>([&](int i) { return i == 0 ? first : a.v[i - 1]; });
}
inline I16 if_else(M16 m, const I16& yes, const I16& no) {
  return each<I16>([&](int i) { return (m.bits >> i & 1) != 0 ? yes.v[i] : no.v[i]; });
}

// ---- Lanes of 32 bits
inline I32 load32(const std::int32_t* from) {
  I32 r;
  std::memcpy(r.v, from, sizeof r.v);
  return r;
}
inline void store(const I32& a, std::int32_t* to) { std::memcpy(to, a.v, sizeof a.v); }
inline I32 set32(std::int32_t value) {
  return each<I32>([&](int) { return value; });
}
inline I32 operator+(const I32& a, const I32& b) {
  return each<I32>([&](int i) { return wrapped(std::int64_t{a.v[i]} + b.v[i]); });
}
inline I32 operator-(const I32& a, const I32& b) {
  return each<I32>([&](int i) { return wrapped(std::int64_t{a.v[i]} - b.v[i]); });
}
inline I32 operator*(const I32& a, const I32& b) {
  return each<I32>([&](int i) { return wrapped(std::int64_t{a.v[i]} * b.v[i]); });
}
inline I32 operator&(const I32& a, const I32& b) {
  return each<I32>([&](int i) { return a.v[i] & b.v[i]; });
}
inline I32 operator|(const I32& a, const I32& b) {
  return each<I32>([&](int i) { return a.v[i] | b.v[i]; });
}
inline I32 max(const I32& a, const I32& b) {
  return each<I32>([&](int i) { return std::max(a.v[i], b.v[i]); });
}
inline I32 min(const I32& a, const I32& b) {
  return each<I32>([&](int i) { return std::min(a.v[i], b.v[i]); });
}
inline I32 absolute(const I32& a) {
  return each<I32>([&](int i) { return std::abs(a.v[i]); });
}
inline I32 negative(const I32& a) {
  return each<I32>([&](int i) { return wrapped(-std::int64_t{a.v[i]}); });
}
template <int bits>
inline I32 shift_left(const I32& a) {
  return each<I32>([&](int i) { return wrapped(std::int64_t{a.v[i]} * (std::int64_t{1} << bits)); });
}
template <int bits>
inline I32 shift_right(const I32& a) {
  return each<I32>([&](int i) { return a.v[i] >> bits; });
}
template <int bits>
inline I32 shift_right_unsigned(const I32& a) {
  return each<I32>(
      [&](int i) { return static_cast<std::int32_t>(static_cast<std::uint32_t>(a.v[i]) >> bits); });
}
inline I32 shift_left(const I32& a, const I32& bits) {
  return each<I32>([&](int i) { return wrapped(std::int64_t{a.v[i]} * (std::int64_t{1} << bits.v[i])); });
}
inline I32 shift_right(const I32& a, const I32& bits) {
  return each<I32>([&](int i) { return a.v[i] >> bits.v[i]; });
}
inline M32 operator==(const I32& a, const I32& b) {
  return where<M32>([&](int i) { return a.v[i] == b.v[i]; });
}
inline M32 operator>(const I32& a, const I32& b) {
  return where<M32>([&](int i) { return a.v[i] > b.v[i]; });
}
inline M32 operator>=(const I32& a, const I32& b) {
  return where<M32>([&](int i) { return a.v[i] >= b.v[i]; });
}
inline M32 is_negative(const I32& a) {
  return where<M32>([&](int i) { return a.v[i] < 0; });
}
inline M32 operator&(M32 a, M32 b) { return {a.bits & b.bits}; }
inline M32 except(M32 a, M32 b) { return {a.bits & ~b.bits}; }
inline I32 if_else(M32 m, const I32& yes, const I32& no) {
  return each<I32>([&](int i) { return (m.bits >> i & 1) != 0 ? yes.v[i] : no.v[i]; });
}
inline I32 if_or_zero(M32 m, const I32& yes) { return if_else(m, yes, set32(0)); }
inline I32 zero_or(M32 m, const I32& no) { return if_else(m, set32(0), no); }
inline I32 gather(const std::int32_t* table, const I32& index) {
  return each<I32>([&](int i) { return table[index.v[i]]; });
}

// ---- Floating point
inline F32 set_float(float value) {
  return each<F32>([&](int) { return value; });
}
inline F32 to_float(const I32& a) {
  return each<F32>([&](int i) { return static_cast<float>(a.v[i]); });
}
inline F32 operator+(const F32& a, const F32& b) {
  return each<F32>([&](int i) { return a.v[i] + b.v[i]; });
}
inline F32 operator*(const F32& a, const F32& b) {
  return each<F32>([&](int i) { return a.v[i] * b.v[i]; });
}
inline F32 operator/(const F32& a, const F32& b) {
  return each<F32>([&](int i) { return a.v[i] / b.v[i]; });
}
inline F32 if_else(M32 m, const F32& yes, const F32& no) {
  return each<F32>([&](int i) { return (m.bits >> i & 1) != 0 ? yes.v[i] : no.v[i]; });
}
inline I32 bits_of(const F32& a) {
  return each<I32>([&](int i) { return std::bit_cast<std::int32_t>(a.v[i]); });
}
inline I32 nearest(const F32& a) {
  constexpr float size = 12582912;
  return bits_of(a + set_float(size)) - set32(std::bit_cast<std::int32_t>(size));
}
inline I32 truncated(const F32& a) {
  return each<I32>([&](int i) { return static_cast<std::int32_t>(a.v[i]); });
}

// ---- Between 16 and 32 bits, and masks as bits
inline I32 widen(const I16& a) {
  return each<I32>([&](int i) { return a.v[i]; });
}
inline I32 widen_unsigned(const I16& a) {
  return each<I32>([&](int i) { return static_cast<std::uint16_t>(a.v[i]); });
}
inline I16 narrow(const I32& a) {
  return each<I16>([&](int i) { return a.v[i]; });
}
inline std::uint32_t bits(M16 m) { return m.bits; }
inline std::uint32_t bits(M32 m) { return m.bits; }
inline M16 mask16(std::uint32_t bits) { return {bits & 0xffff}; }
inline M32 mask32(std::uint32_t bits) { return {bits & 0xffff}; }
inline M32 widen(M16 m) { return {m.bits}; }

// ---- Sums of products
struct PairSums {
  I32 of_lane;
};
inline PairSums no_sums() { return {set32(0)}; }
inline void add_products(const I16& a, const I16& b, const std::int16_t* weights, PairSums& s) {
  s.of_lane = each<I32>([&](int i) {
    const int at = (i & 4) * 4 + 2 * ((i & 3) + (i >> 3) * 4);
    return wrapped(std::int64_t{s.of_lane.v[i]} + a.v[i] * weights[at] + b.v[i] * weights[at + 1]);
  });
}
inline I32 total(const PairSums& a, const PairSums& b) { return a.of_lane + b.of_lane; }

// ---- Eight lanes of 16 bits
struct Eight {
  std::int16_t v[8];
};
inline Eight load8(const void* from) {
  Eight r;
  std::memcpy(r.v, from, sizeof r.v);
  return r;
}
inline void store(const Eight& a, void* to) { std::memcpy(to, a.v, sizeof a.v); }
inline Eight if_else(const Eight& mask, const Eight& yes, const Eight& no) {
  Eight r;
  for (int i = 0; i < 8; ++i) r.v[i] = mask.v[i] != 0 ? yes.v[i] : no.v[i];
  return r;
}
inline void transpose(Eight (&v)[8]) {
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < i; ++k) std::swap(v[i].v[k], v[k].v[i]);
}

// ---- Words of a set of lanes
inline I32 take_words(const void* words, std::uint32_t lanes) {
  const auto* from = static_cast<const std::uint8_t*>(words);
  return each<I32>([&](int i) {
    std::uint16_t word = 0;
    if ((lanes >> i & 1) != 0) {
      std::memcpy(&word, from, sizeof word);
      from += sizeof word;
    }
    return word;
  });
}
inline std::uint16_t* give_words(const I32& numbers, std::uint32_t lanes, std::uint16_t* end) {
  for (int i = 16; i-- > 0;)
    if ((lanes >> i & 1) != 0) *--end = static_cast<std::uint16_t>(numbers.v[i]);
  return end;
}

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
