// What vectors.h does across lanes, as loops, for machines without vector instructions.
#pragma once

#include <cstdint>
#include <cstring>
#include <utility>

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

// ---- Sums of products
struct PairSums {
  I32 of_lane;
};
inline PairSums no_sums() { return {set32(0)}; }
inline void add_products(const I16& a, const I16& b, const std::int16_t* weights, PairSums& s) {
  for (int i = 0; i < 16; ++i) {
    const int at = (i & 4) * 4 + 2 * ((i & 3) + (i >> 3) * 4);
    const std::int64_t sum =
        std::int64_t{s.of_lane.v[i].raw} + a.v[i].raw * weights[at] + b.v[i].raw * weights[at + 1];
    s.of_lane.v[i].raw = static_cast<std::int32_t>(static_cast<std::uint32_t>(sum));
  }
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
  I32 r = set32(0);
  for (int i = 0; i < 16; ++i) {
    if ((lanes >> i & 1) == 0) continue;
    std::uint16_t word;
    std::memcpy(&word, from, sizeof word);
    from += sizeof word;
    r.v[i].raw = word;
  }
  return r;
}
inline std::uint16_t* give_words(const I32& numbers, std::uint32_t lanes, std::uint16_t* end) {
  for (int i = 16; i-- > 0;)
    if ((lanes >> i & 1) != 0) *--end = static_cast<std::uint16_t>(numbers.v[i].raw);
  return end;
}

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
