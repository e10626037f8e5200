// Sixteen lanes, in as many vectors as the machine needs: one of 512 bits, two of 256 or four of 128. They
// are compiled for each instruction set (target.h), and all compute the same.
#pragma once

#include <hwy/highway.h>

#include "stages/values/wavefront/words.h"

// gcc unrolls loops over lanes only if it is told to; clang does it by itself. A step is inlined into the
// loop over steps. Without vectors, or under sanitizers, both would only make much code.
#if HWY_TARGET == HWY_SCALAR || defined(TAGRID_SMALL_CODE)
#define TAGRID_UNROLL
#define TAGRID_STEP HWY_NOINLINE
#define TAGRID_LANE inline
#elif defined(__clang__)
#define TAGRID_UNROLL _Pragma("unroll")
#define TAGRID_STEP HWY_INLINE
#define TAGRID_LANE HWY_INLINE
#else
#define TAGRID_UNROLL _Pragma("GCC unroll 16")
#define TAGRID_STEP HWY_INLINE
#define TAGRID_LANE HWY_INLINE
#endif

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

// A statement for each vector `j` of sixteen lanes of 16 bits, or of 32.
#define TAGRID_AT(index, ...) \
  {                           \
    constexpr int j = index;  \
    __VA_ARGS__               \
  }
#if HWY_TARGET == HWY_SCALAR
#define TAGRID_EACH16(...)       \
  for (int j = 0; j < 16; ++j) { \
    __VA_ARGS__                  \
  }
#define TAGRID_EACH32(...) TAGRID_EACH16(__VA_ARGS__)
#elif HWY_MAX_BYTES == 64
#define TAGRID_EACH16(...) TAGRID_AT(0, __VA_ARGS__)
#define TAGRID_EACH32(...) TAGRID_AT(0, __VA_ARGS__)
#elif HWY_MAX_BYTES == 32
#define TAGRID_EACH16(...) TAGRID_AT(0, __VA_ARGS__)
#define TAGRID_EACH32(...) TAGRID_AT(0, __VA_ARGS__) TAGRID_AT(1, __VA_ARGS__)
#else
#define TAGRID_EACH16(...) TAGRID_AT(0, __VA_ARGS__) TAGRID_AT(1, __VA_ARGS__)
#define TAGRID_EACH32(...) \
  TAGRID_AT(0, __VA_ARGS__) TAGRID_AT(1, __VA_ARGS__) TAGRID_AT(2, __VA_ARGS__) TAGRID_AT(3, __VA_ARGS__)
#endif

// A function whose result has the given expression as its vector j.
#define TAGRID_LANES16(Result, name, parameters, ...) \
  TAGRID_LANE Result name parameters {                \
    Result r;                                         \
    TAGRID_EACH16(r.v[j] = __VA_ARGS__;)              \
    return r;                                         \
  }
#define TAGRID_LANES32(Result, name, parameters, ...) \
  TAGRID_LANE Result name parameters {                \
    Result r;                                         \
    TAGRID_EACH32(r.v[j] = __VA_ARGS__;)              \
    return r;                                         \
  }

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Lanes of a vector.
#if HWY_TARGET == HWY_SCALAR
inline constexpr std::size_t width16 = 1, width32 = 1;
#else
inline constexpr std::size_t width16 = HWY_MAX_BYTES >= 32 ? 16 : 8;
inline constexpr std::size_t width32 = HWY_MAX_BYTES >= 64 ? 16 : HWY_MAX_BYTES / 4;
#endif
using D16 = hn::FixedTag<std::int16_t, width16>;
using DU16 = hn::FixedTag<std::uint16_t, width16>;
using D32 = hn::FixedTag<std::int32_t, width32>;
using DU32 = hn::FixedTag<std::uint32_t, width32>;
using DF = hn::FixedTag<float, width32>;

struct I16 {
  hn::Vec<D16> v[16 / width16];
};
struct I32 {
  hn::Vec<D32> v[16 / width32];
};
struct F32 {
  hn::Vec<DF> v[16 / width32];
};
struct M16 {
  hn::Mask<D16> v[16 / width16];
};
struct M32 {
  hn::Mask<D32> v[16 / width32];
};

// clang-format off

// ---- Lanes of 16 bits. Memory needs no alignment.
TAGRID_LANES16(I16, load16, (const void* from),
               hn::LoadU(D16(), static_cast<const std::int16_t*>(from) + j * width16))
TAGRID_LANE void store(I16 a, void* to) {
  TAGRID_EACH16(hn::StoreU(a.v[j], D16(), static_cast<std::int16_t*>(to) + j * width16);)
}
TAGRID_LANES16(I16, set16, (int value), hn::Set(D16(), static_cast<std::int16_t>(value)))
TAGRID_LANES16(I16, operator+, (I16 a, I16 b), hn::Add(a.v[j], b.v[j]))
TAGRID_LANES16(I16, operator-, (I16 a, I16 b), hn::Sub(a.v[j], b.v[j]))
TAGRID_LANES16(I16, operator*, (I16 a, I16 b), hn::Mul(a.v[j], b.v[j]))
TAGRID_LANES16(I16, max, (I16 a, I16 b), hn::Max(a.v[j], b.v[j]))
TAGRID_LANES16(I16, min, (I16 a, I16 b), hn::Min(a.v[j], b.v[j]))
/// All lanes by the same number of bits; copies of the sign come in from the left.
TAGRID_LANES16(I16, shift_right, (I16 a, int bits), hn::ShiftRightSame(a.v[j], bits))
template <int bits>
TAGRID_LANES16(I16, shift_left, (I16 a), hn::ShiftLeft<bits>(a.v[j]))
TAGRID_LANES16(M16, operator==, (I16 a, I16 b), hn::Eq(a.v[j], b.v[j]))
/// a <= b, as numbers without a sign.
TAGRID_LANE M16 not_above(I16 a, I16 b) {
  M16 r;
  TAGRID_EACH16(const auto x = hn::BitCast(DU16(), a.v[j]);
                r.v[j] = hn::RebindMask(D16(), hn::Eq(x, hn::Min(x, hn::BitCast(DU16(), b.v[j]))));)
  return r;
}
TAGRID_LANES16(M16, operator&, (M16 a, M16 b), hn::And(a.v[j], b.v[j]))
/// Every lane to the next one; `first` to the first.
TAGRID_LANE I16 next_lane(I16 a, std::int16_t first) {
  const auto before = hn::Set(D16(), first);
#if HWY_TARGET == HWY_SCALAR
  I16 r;
  TAGRID_EACH16(r.v[j] = j == 0 ? before : a.v[j - 1];)
  return r;
#elif HWY_MAX_BYTES >= 32
  return {{hn::CombineShiftRightBytes<14>(D16(), a.v[0], hn::ConcatLowerLower(D16(), a.v[0], before))}};
#else
  return {{hn::CombineShiftRightBytes<14>(D16(), a.v[0], before),
           hn::CombineShiftRightBytes<14>(D16(), a.v[1], a.v[0])}};
#endif
}
TAGRID_LANES16(I16, if_else, (M16 m, I16 yes, I16 no), hn::IfThenElse(m.v[j], yes.v[j], no.v[j]))

// ---- Lanes of 32 bits.
TAGRID_LANES32(I32, load32, (const std::int32_t* from), hn::LoadU(D32(), from + j * width32))
TAGRID_LANE void store(I32 a, std::int32_t* to) {
  TAGRID_EACH32(hn::StoreU(a.v[j], D32(), to + j * width32);)
}
TAGRID_LANES32(I32, set32, (std::int32_t value), hn::Set(D32(), value))
TAGRID_LANES32(I32, operator+, (I32 a, I32 b), hn::Add(a.v[j], b.v[j]))
TAGRID_LANES32(I32, operator-, (I32 a, I32 b), hn::Sub(a.v[j], b.v[j]))
TAGRID_LANES32(I32, operator*, (I32 a, I32 b), hn::Mul(a.v[j], b.v[j]))
TAGRID_LANES32(I32, operator&, (I32 a, I32 b), hn::And(a.v[j], b.v[j]))
TAGRID_LANES32(I32, operator|, (I32 a, I32 b), hn::Or(a.v[j], b.v[j]))
TAGRID_LANES32(I32, max, (I32 a, I32 b), hn::Max(a.v[j], b.v[j]))
TAGRID_LANES32(I32, min, (I32 a, I32 b), hn::Min(a.v[j], b.v[j]))
TAGRID_LANES32(I32, absolute, (I32 a), hn::Abs(a.v[j]))
TAGRID_LANES32(I32, negative, (I32 a), hn::Neg(a.v[j]))
template <int bits>
TAGRID_LANES32(I32, shift_left, (I32 a), hn::ShiftLeft<bits>(a.v[j]))
/// Copies of the sign come in from the left.
template <int bits>
TAGRID_LANES32(I32, shift_right, (I32 a), hn::ShiftRight<bits>(a.v[j]))
template <int bits>
TAGRID_LANES32(I32, shift_right_unsigned, (I32 a),
               hn::BitCast(D32(), hn::ShiftRight<bits>(hn::BitCast(DU32(), a.v[j]))))
/// Each lane by a number of bits of its own.
TAGRID_LANES32(I32, shift_left, (I32 a, I32 bits), hn::Shl(a.v[j], bits.v[j]))
TAGRID_LANES32(I32, shift_right, (I32 a, I32 bits), hn::Shr(a.v[j], bits.v[j]))
TAGRID_LANES32(M32, operator==, (I32 a, I32 b), hn::Eq(a.v[j], b.v[j]))
TAGRID_LANES32(M32, operator>, (I32 a, I32 b), hn::Gt(a.v[j], b.v[j]))
TAGRID_LANES32(M32, operator>=, (I32 a, I32 b), hn::Not(hn::Lt(a.v[j], b.v[j])))
TAGRID_LANES32(M32, is_negative, (I32 a), hn::Lt(a.v[j], hn::Zero(D32())))
TAGRID_LANES32(M32, operator&, (M32 a, M32 b), hn::And(a.v[j], b.v[j]))
/// a and not b.
TAGRID_LANES32(M32, except, (M32 a, M32 b), hn::AndNot(b.v[j], a.v[j]))
TAGRID_LANES32(I32, if_else, (M32 m, I32 yes, I32 no), hn::IfThenElse(m.v[j], yes.v[j], no.v[j]))
TAGRID_LANES32(I32, if_or_zero, (M32 m, I32 yes), hn::IfThenElseZero(m.v[j], yes.v[j]))
TAGRID_LANES32(I32, zero_or, (M32 m, I32 no), hn::IfThenZeroElse(m.v[j], no.v[j]))
TAGRID_LANES32(F32, if_else, (M32 m, F32 yes, F32 no),
               hn::IfThenElse(hn::RebindMask(DF(), m.v[j]), yes.v[j], no.v[j]))
TAGRID_LANES32(I32, gather, (const std::int32_t* table, I32 index), hn::GatherIndex(D32(), table, index.v[j]))

// ---- Floating point. Numbers below 2^24 are exact.
TAGRID_LANES32(F32, set_float, (float value), hn::Set(DF(), value))
TAGRID_LANES32(F32, to_float, (I32 a), hn::ConvertTo(DF(), a.v[j]))
TAGRID_LANES32(F32, operator+, (F32 a, F32 b), hn::Add(a.v[j], b.v[j]))
TAGRID_LANES32(F32, operator*, (F32 a, F32 b), hn::Mul(a.v[j], b.v[j]))
TAGRID_LANES32(F32, operator/, (F32 a, F32 b), hn::Div(a.v[j], b.v[j]))
TAGRID_LANES32(I32, bits_of, (F32 a), hn::BitCast(D32(), a.v[j]))
/// The integer nearest to a. REQUIRES: |a| < 2^22.
TAGRID_LANE I32 nearest(F32 a) {
  // The last bit of a float of this size is worth 1.
  constexpr float size = 12582912;
  return bits_of(a + set_float(size)) - set32(std::bit_cast<std::int32_t>(size));
}
/// Toward zero.
TAGRID_LANES32(I32, truncated, (F32 a), hn::ConvertTo(D32(), a.v[j]))

// clang-format on

// ---- Between 16 and 32 bits, and masks as bits.
#if HWY_TARGET == HWY_SCALAR || HWY_MAX_BYTES == 64
TAGRID_LANES32(I32, widen, (I16 a), hn::PromoteTo(D32(), a.v[j]))
TAGRID_LANES32(I32, widen_unsigned, (I16 a), hn::PromoteTo(D32(), hn::BitCast(DU16(), a.v[j])))
/// REQUIRES: every lane fits into 16 bits with a sign.
TAGRID_LANES16(I16, narrow, (I32 a), hn::DemoteTo(D16(), a.v[j]))
#else
TAGRID_LANE I32 widen(I16 a) {
  using Half = hn::Half<D16>;
#if HWY_MAX_BYTES == 32
  return {{hn::PromoteTo(D32(), hn::LowerHalf(Half(), a.v[0])),
           hn::PromoteTo(D32(), hn::UpperHalf(Half(), a.v[0]))}};
#else
  return {{hn::PromoteTo(D32(), hn::LowerHalf(Half(), a.v[0])),
           hn::PromoteTo(D32(), hn::UpperHalf(Half(), a.v[0])),
           hn::PromoteTo(D32(), hn::LowerHalf(Half(), a.v[1])),
           hn::PromoteTo(D32(), hn::UpperHalf(Half(), a.v[1]))}};
#endif
}
TAGRID_LANE I32 widen_unsigned(I16 a) { return widen(a) & set32(0xffff); }
TAGRID_LANE I16 narrow(I32 a) {
#if HWY_TARGET == HWY_AVX2
  // Each half of the result has a half of each operand.
  const auto mixed = hn::BitCast(D32(), hn::ReorderDemote2To(D16(), a.v[0], a.v[1]));
  alignas(32) static constexpr std::int32_t order[8] = {0, 1, 4, 5, 2, 3, 6, 7};
  return {{hn::BitCast(D16(), hn::TableLookupLanes(mixed, hn::SetTableIndices(D32(), order)))}};
#elif HWY_MAX_BYTES == 32
  return {{hn::Combine(D16(), hn::DemoteTo(hn::Half<D16>(), a.v[1]), hn::DemoteTo(hn::Half<D16>(), a.v[0]))}};
#else
  using Half = hn::Half<D16>;
  return {{hn::Combine(D16(), hn::DemoteTo(Half(), a.v[1]), hn::DemoteTo(Half(), a.v[0])),
           hn::Combine(D16(), hn::DemoteTo(Half(), a.v[3]), hn::DemoteTo(Half(), a.v[2]))}};
#endif
}
#endif
#if HWY_MAX_BYTES == 64
TAGRID_LANE std::uint32_t bits(M16 m) { return m.v[0].raw; }
TAGRID_LANE std::uint32_t bits(M32 m) { return m.v[0].raw; }
TAGRID_LANE M16 mask16(std::uint32_t bits) { return {{{static_cast<__mmask16>(bits)}}}; }
TAGRID_LANE M32 mask32(std::uint32_t bits) { return {{{static_cast<__mmask16>(bits)}}}; }
TAGRID_LANE M32 widen(M16 m) { return mask32(bits(m)); }
#else
#if HWY_TARGET == HWY_WASM
// Highway 1.0 stores and multiplies; this is one instruction after narrowing.
TAGRID_LANE std::uint32_t bits(M16 m) {
  return wasm_i8x16_bitmask(wasm_i8x16_narrow_i16x8(m.v[0].raw, m.v[1].raw));
}
TAGRID_LANE std::uint32_t bits(M32 m) {
  return wasm_i8x16_bitmask(wasm_i8x16_narrow_i16x8(wasm_i16x8_narrow_i32x4(m.v[0].raw, m.v[1].raw),
                                                    wasm_i16x8_narrow_i32x4(m.v[2].raw, m.v[3].raw)));
}
#else
TAGRID_LANE std::uint32_t bits(M16 m) {
  std::uint32_t all = 0;
  TAGRID_EACH16(std::uint8_t part[8] = {}; hn::StoreMaskBits(D16(), m.v[j], part);
                all |= (part[0] | std::uint32_t{part[1]} << 8) << (j * width16);)
  return all;
}
TAGRID_LANE std::uint32_t bits(M32 m) {
  std::uint32_t all = 0;
  TAGRID_EACH32(std::uint8_t part[8] = {}; hn::StoreMaskBits(D32(), m.v[j], part);
                all |= std::uint32_t{part[0]} << (j * width32);)
  return all;
}
#endif
TAGRID_LANE M16 mask16(std::uint32_t bits) {
  static constexpr std::uint16_t of_lane[16] = {1,   2,   4,    8,    16,   32,   64,    128,
                                                256, 512, 1024, 2048, 4096, 8192, 16384, 32768};
  const auto all = hn::Set(DU16(), static_cast<std::uint16_t>(bits));
  M16 r;
  TAGRID_EACH16(const auto lane = hn::LoadU(DU16(), of_lane + j * width16);
                r.v[j] = hn::RebindMask(D16(), hn::Eq(hn::And(all, lane), lane));)
  return r;
}
TAGRID_LANE M32 mask32(std::uint32_t bits) {
  static constexpr std::int32_t of_lane[16] = {1,   2,   4,    8,    16,   32,   64,    128,
                                               256, 512, 1024, 2048, 4096, 8192, 16384, 32768};
  const auto all = hn::Set(D32(), static_cast<std::int32_t>(bits));
  M32 r;
  TAGRID_EACH32(const auto lane = hn::LoadU(D32(), of_lane + j * width32);
                r.v[j] = hn::Eq(hn::And(all, lane), lane);)
  return r;
}
TAGRID_LANE M32 widen(M16 m) {
  I16 lanes;
  TAGRID_EACH16(lanes.v[j] = hn::VecFromMask(D16(), m.v[j]);)
  const I32 wide = widen(lanes);
  M32 r;
  TAGRID_EACH32(r.v[j] = hn::MaskFromVec(wide.v[j]);)
  return r;
}
#endif

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_TARGET == HWY_SCALAR
#include "stages/values/wavefront/scalar.h"
#else

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

// ---- Sums of products of 16 bits, in an order of their own.
/// Lanes 0 .. 3 and 8 .. 11 are in `low`, the others in `high`; each in two parts on machines that do not add
/// neighbors.
struct PairSums {
  hn::Vec<hn::Repartition<std::int32_t, D16> > low[16 / width16], high[16 / width16], low2[16 / width16],
      high2[16 / width16];
};
TAGRID_LANE PairSums no_sums() {
  PairSums s;
  const auto zero = hn::Zero(hn::Repartition<std::int32_t, D16>());
  TAGRID_EACH16(s.low[j] = s.high[j] = s.low2[j] = s.high2[j] = zero;)
  return s;
}
/// Adds a * x + b * y in every lane. `weights`: x and y of the lanes in `low`, then of those in `high`.
TAGRID_LANE void add_products(I16 a, I16 b, const std::int16_t* weights, PairSums& s) {
  const hn::Repartition<std::int32_t, D16> d;
  TAGRID_EACH16(s.low[j] = hn::ReorderWidenMulAccumulate(d, hn::InterleaveLower(D16(), a.v[j], b.v[j]),
                                                         hn::LoadU(D16(), weights + j * width16), s.low[j],
                                                         s.low2[j]);
                s.high[j] = hn::ReorderWidenMulAccumulate(d, hn::InterleaveUpper(D16(), a.v[j], b.v[j]),
                                                          hn::LoadU(D16(), weights + 16 + j * width16),
                                                          s.high[j], s.high2[j]);)
}
TAGRID_LANE I32 total(PairSums a, PairSums b) {
  const hn::Repartition<std::int32_t, D16> d;
  TAGRID_EACH16(a.low[j] = hn::Add(hn::RearrangeToOddPlusEven(a.low[j], a.low2[j]),
                                   hn::RearrangeToOddPlusEven(b.low[j], b.low2[j]));
                a.high[j] = hn::Add(hn::RearrangeToOddPlusEven(a.high[j], a.high2[j]),
                                    hn::RearrangeToOddPlusEven(b.high[j], b.high2[j]));)
#if HWY_MAX_BYTES == 64
  alignas(64) static constexpr std::int32_t order[16] = {0, 1, 2, 3, 8,  9,  10, 11,
                                                         4, 5, 6, 7, 12, 13, 14, 15};
  (void)d;
  return {{hn::TableLookupLanes(hn::Combine(D32(), a.high[0], a.low[0]), hn::SetTableIndices(D32(), order))}};
#elif HWY_MAX_BYTES == 32
  return {{hn::ConcatLowerLower(d, a.high[0], a.low[0]), hn::ConcatUpperUpper(d, a.high[0], a.low[0])}};
#else
  (void)d;
  return {{a.low[0], a.high[0], a.low[1], a.high[1]}};
#endif
}

// ---- Eight lanes of 16 bits
struct Eight {
  hn::Vec<hn::FixedTag<std::int16_t, 8> > v;
};
TAGRID_LANE Eight load8(const void* from) {
  return {hn::LoadU(hn::FixedTag<std::int16_t, 8>(), static_cast<const std::int16_t*>(from))};
}
TAGRID_LANE void store(Eight a, void* to) {
  hn::StoreU(a.v, hn::FixedTag<std::int16_t, 8>(), static_cast<std::int16_t*>(to));
}
/// `mask`: every lane is 0 or -1.
TAGRID_LANE Eight if_else(Eight mask, Eight yes, Eight no) {
  return {hn::IfThenElse(hn::MaskFromVec(mask.v), yes.v, no.v)};
}
/// The bytes with these numbers; 0 for a number with the upper bit.
TAGRID_LANE Eight bytes(Eight of, const std::uint8_t* numbers) {
  const hn::FixedTag<std::uint8_t, 16> d;
  return {hn::BitCast(hn::FixedTag<std::int16_t, 8>(),
                      hn::TableLookupBytesOr0(hn::BitCast(d, of.v), hn::LoadU(d, numbers)))};
}
/// Turns 8 rows of 8 numbers into 8 columns.
TAGRID_LANE void transpose(Eight (&v)[8]) {
  const hn::FixedTag<std::int16_t, 8> d16;
  const hn::FixedTag<std::int32_t, 4> d32;
  const hn::FixedTag<std::int64_t, 2> d64;
  Eight a[8], b[8];
  TAGRID_UNROLL
  for (int i = 0; i < 4; ++i) {
    a[2 * i].v = hn::InterleaveLower(d16, v[2 * i].v, v[2 * i + 1].v);
    a[2 * i + 1].v = hn::InterleaveUpper(d16, v[2 * i].v, v[2 * i + 1].v);
  }
  TAGRID_UNROLL
  for (int i = 0; i < 4; ++i) {
    const auto p = hn::BitCast(d32, a[i / 2 * 4 + i % 2].v), q = hn::BitCast(d32, a[i / 2 * 4 + i % 2 + 2].v);
    b[2 * i].v = hn::BitCast(d16, hn::InterleaveLower(d32, p, q));
    b[2 * i + 1].v = hn::BitCast(d16, hn::InterleaveUpper(d32, p, q));
  }
  TAGRID_UNROLL
  for (int i = 0; i < 4; ++i) {
    const auto p = hn::BitCast(d64, b[i].v), q = hn::BitCast(d64, b[i + 4].v);
    v[2 * i].v = hn::BitCast(d16, hn::InterleaveLower(d64, p, q));
    v[2 * i + 1].v = hn::BitCast(d16, hn::InterleaveUpper(d64, p, q));
  }
}

// ---- Words of a set of lanes, one after the other in memory

/// The n-th word goes to the n-th lane of the set. Reads sixteen words.
TAGRID_LANE I32 take_words(const void* words, std::uint32_t lanes) {
#if HWY_TARGET == HWY_AVX3
  return {{{_mm512_maskz_expand_epi32(
      static_cast<__mmask16>(lanes),
      _mm512_cvtepu16_epi32(_mm256_loadu_si256(static_cast<const __m256i*>(words))))}}};
#else
  alignas(32) std::int16_t all[16];
  const auto* const from = static_cast<const std::uint8_t*>(words);
  store(bytes(load8(from), word_tables.taken[lanes & 255]), all);
  store(bytes(load8(from + 2 * std::popcount(lanes & 255)), word_tables.taken[lanes >> 8]), all + 8);
  return widen_unsigned(load16(all));
#endif
}
/// Writes the lower halves of the lanes of the set before `end`, and returns where the first of them is. May
/// write more below.
TAGRID_LANE std::uint16_t* give_words(I32 numbers, std::uint32_t lanes, std::uint16_t* end) {
#if HWY_TARGET == HWY_AVX3
  const int count = std::popcount(lanes);
  end -= count;
  const __m512i together = _mm512_maskz_compress_epi32(static_cast<__mmask16>(lanes), numbers.v[0].raw);
  _mm256_mask_storeu_epi16(end, static_cast<__mmask16>((1u << count) - 1), _mm512_cvtepi32_epi16(together));
  return end;
#else
  // The upper bit is the sign of a number of 16 bits.
  alignas(32) std::int16_t all[16];
  store(narrow(shift_right<16>(shift_left<16>(numbers))), all);
  store(bytes(load8(all + 8), word_tables.given[lanes >> 8]), end - 8);
  end -= std::popcount(lanes >> 8);
  store(bytes(load8(all), word_tables.given[lanes & 255]), end - 8);
  return end - std::popcount(lanes & 255);
#endif
}

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
