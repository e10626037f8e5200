#include "stages/values/sides/sides.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <type_traits>

#include "stages/entropy/adaptive_bit.h"
#include "stages/entropy/rans_coder.h"
#include "stages/sample/sample_type.h"

namespace tagrid {
namespace {

enum Side : std::uint8_t { below, above };
constexpr std::size_t sides = 2, distances = 8;

// With errors that are equally probable up to the reach, a sample in the middle of the i-th eighth has crossed with
// the probability 1/2 - (i + 1/2) / 16.
constexpr std::array<int, distances> start_logits = {-32, -97, -166, -240, -326, -432, -581, -879};
constexpr std::uint32_t seen_at_start = 4, slowest = 1000;

/// One threshold in a brick.
template <class T>
class Crossing {
 public:
  explicit Crossing(double threshold)
      : values_{below_threshold(static_cast<T>(threshold)), static_cast<T>(threshold)} {
    for (auto& of_side : crossed_)
      for (std::size_t i = 0; i < distances; ++i) of_side[i] = AdaptiveBit(start_logits[i], seen_at_start);
  }

  Side side_of(T sample) const { return sample >= values_[above] ? above : below; }
  /// The sample of a side that is next to the threshold.
  T next(Side side) const { return values_[side]; }
  /// From next(side) to a sample on that side. Not finite for one that is not.
  double distance(T sample, Side side) const {
    return std::abs(static_cast<double>(sample) - static_cast<double>(values_[side]));
  }

  /// Takes a decoded sample that is on the wrong side.
  void extend_reach(T sample) {
    const Side side = side_of(sample);
    reach_[side] = std::max(reach_[side], distance(sample, side));
  }
  bool is_crossed() const { return std::max(reach_[below], reach_[above]) >= 0; }

  /// Codes how far from the threshold samples of each side are that crossed it.
  template <class Coder>
  void code_reach(Coder& coder, IntegerModel& model) {
    for (double& reach : reach_) {
      if constexpr (std::is_integral_v<T>) {
        reach = static_cast<double>(model.code(coder, static_cast<std::uint64_t>(reach + 1))) - 1;
      } else {
        std::uint64_t bits = 0;
        for (int shift = 48; shift >= 0; shift -= 16)
          bits = bits << 16 | coder.code_raw(std::bit_cast<std::uint64_t>(reach) >> shift & 0xFFFF, 16);
        reach = std::bit_cast<double>(bits);
      }
    }
  }

  /// Codes a sample if it may have crossed; moves it if it has. `original`: which side it should be on.
  template <class Coder>
  bool code(Coder& coder, T& sample, Side original) {
    const Side side = side_of(sample);
    const double from = distance(sample, side);
    if (!(from <= reach_[side])) return false;
    std::size_t eighth = 0;
    for (std::size_t i = 1; i < distances; ++i) eighth += 8 * from > static_cast<double>(i) * reach_[side];
    if (!code_adaptive(coder, side != original, crossed_[side][eighth], slowest)) return false;
    sample = next(side == above ? below : above);
    return true;
  }

 private:
  std::array<T, sides> values_;
  std::array<double, sides> reach_ = {-1, -1};  ///< negative: no sample of this side has crossed
  std::array<std::array<AdaptiveBit, distances>, sides> crossed_;
};

template <class T>
std::vector<Crossing<T>> crossings(const Thresholds& thresholds) {
  return {thresholds.numbers().begin(), thresholds.numbers().end()};
}

// How often samples were moved, threshold by threshold, and whether any was.
template <class T>
bool find_reaches(std::span<const T> original, std::span<const T> decoded,
                  std::vector<Crossing<T>>& thresholds, OfThresholds<std::uint64_t>& moved) {
  for (std::size_t i = 0; i < decoded.size(); ++i) {
    T sample = decoded[i];
    for (std::size_t k = 0; k < thresholds.size(); ++k) {
      const Side side = thresholds[k].side_of(original[i]);
      if (thresholds[k].side_of(sample) == side) continue;
      thresholds[k].extend_reach(sample);
      sample = thresholds[k].next(side);
      ++moved.all[k];
    }
  }
  return std::ranges::any_of(thresholds, [](const auto& threshold) { return threshold.is_crossed(); });
}

}  // namespace

template <class T>
void encode_sides(std::span<const T> original, const Thresholds& thresholds, std::span<T> decoded,
                  OfThresholds<std::uint64_t>& moved, std::vector<std::uint8_t>& out) {
  moved.count = thresholds.count;
  if (thresholds.count == 0) return;  // most files: no pass over the samples
  std::vector<Crossing<T>> all = crossings<T>(thresholds);
  if (!find_reaches<T>(original, decoded, all, moved)) return;
  RansEncoder coder(out);
  IntegerModel reach;
  for (Crossing<T>& one : all) one.code_reach(coder, reach);
  for (std::size_t i = 0; i < decoded.size(); ++i)
    for (Crossing<T>& one : all) one.code(coder, decoded[i], one.side_of(original[i]));
  coder.finish();
}

template <class T>
Status decode_sides(std::span<const std::uint8_t> bytes, const Thresholds& thresholds, bool are_all,
                    std::span<T> decoded) {
  std::vector<Crossing<T>> all = crossings<T>(thresholds);
  RansDecoder coder(bytes);
  IntegerModel reach;
  for (Crossing<T>& one : all) one.code_reach(coder, reach);
  for (T& sample : decoded)
    for (Crossing<T>& one : all) one.code(coder, sample, above);
  const bool is_broken = are_all ? !coder.finished() : coder.exhausted();
  return is_broken ? Status::broken("the sides of thresholds end too soon, or too late") : Status();
}

std::uint64_t working_bytes_of_sides(std::uint64_t samples, std::size_t thresholds) {
  // The code of a reach is short.
  return thresholds == 0 ? 0 : RansEncoder::working_bytes((samples + 64) * thresholds);
}

#define TAGRID_INSTANTIATE(T)                                                           \
  template void encode_sides(std::span<const T>, const Thresholds&, std::span<T>,       \
                             OfThresholds<std::uint64_t>&, std::vector<std::uint8_t>&); \
  template Status decode_sides(std::span<const std::uint8_t>, const Thresholds&, bool, std::span<T>);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
