#include "stages/activity/neighbour_words.h"

#include <bit>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/activity/neighbour_words.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "stages/sample/instruction_sets.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR
void transpose(const std::uint64_t* words, std::uint8_t* bytes) {
  for (int i = 0; i < 64; ++i) {
    bytes[i] = 0;
    for (int k = 0; k < 8; ++k) bytes[i] = static_cast<std::uint8_t>(bytes[i] | (words[k] >> i & 1) << k);
  }
}
#else
void transpose(const std::uint64_t* words, std::uint8_t* bytes) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::CappedTag<std::uint8_t, 64> d;
  // A mask is a bit for each lane: here, those of one word. Eight bytes are read for each.
  std::uint8_t masks[9 * sizeof(std::uint64_t)] = {};
  std::memcpy(masks, words, 8 * sizeof(std::uint64_t));
  for (std::size_t i = 0; i < 64; i += hn::Lanes(d)) {
    auto all = hn::Zero(d);
    for (std::size_t k = 0; k < 8; ++k) {
      const auto bit = hn::Set(d, static_cast<std::uint8_t>(1u << k));
      all = hn::Or(all, hn::IfThenElseZero(hn::LoadMaskBits(d, masks + 8 * k + i / 8), bit));
    }
    hn::StoreU(all, d, bytes + i);
  }
}
#endif

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tagrid {

// Bytes of words are in the order of their bits.
static_assert(std::endian::native == std::endian::little);

void BytesOfPoints::transpose(const Words& words) {
  TAGRID_BEST_VERSION(transpose)(words.data(), bytes_.data());
}

}  // namespace tagrid
#endif
