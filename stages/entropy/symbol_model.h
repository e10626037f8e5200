// Adaptive probabilities of sixteen symbols. A model is one vector of cumulative probabilities: mixing,
// searching and learning are a few vector operations (after J. Duda's and F. Giesen's adaptive
// models for rANS of small alphabets); stages/values/wavefront does them.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace tagrid {

inline constexpr std::size_t symbol_count = 16;

/// below[s]: the probability of a symbol less than s, in 2^-15, for s = 1 .. 15. below[0] is the model's age:
/// it approaches 32767 as fast as the probabilities approach the observed ones.
struct SymbolModel {
  std::array<std::int16_t, symbol_count> below;
};
// glibc 2.36 does not use the holes of a heap for blocks of more alignment, so the heap would grow with every
// brick.
static_assert(alignof(SymbolModel) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__);

/// Age of a new model. Its initial probabilities count as some observations, so learning begins with 1/8.
inline constexpr std::int16_t start_age = 18432;

/// The content of a model in which one symbol is certain, except for the least probability that every symbol
/// keeps.
struct SymbolTargets {
  static constexpr int least = 4;  ///< 2^-15
  alignas(32) std::array<decltype(SymbolModel::below), symbol_count> of;

  constexpr SymbolTargets() : of{} {
    for (std::size_t s = 0; s < symbol_count; ++s)
      for (std::size_t i = 0; i < symbol_count; ++i)
        of[s][i] = static_cast<std::int16_t>(i == 0  ? 32767
                                             : i > s ? 32768 - static_cast<int>(symbol_count - i) * least
                                                     : static_cast<int>(i) * least);
  }
};
inline constexpr SymbolTargets symbol_targets;

/// Indexed by age / 1024: a model moves by 1/4 when it is new, and by 1/64 when it is old.
inline constexpr std::array<std::int32_t, 32> learning_rates = [] {
  std::array<std::int32_t, 32> rates{};
  for (std::uint32_t i = 0; i < 32; ++i)
    rates[i] = std::min(17 - static_cast<int>(std::bit_width(32767 - 1024 * i)), 6);
  return rates;
}();

/// The initial model for residuals whose mean magnitude is `mean` / `of` (of > 0): a two-sided geometric
/// distribution around symbol 7, with the last symbol for everything beyond.
inline SymbolModel geometric_model(std::uint64_t mean, std::uint64_t of) {
  // If m is the mean magnitude, the ratio of neighboring probabilities is (sqrt(1 + m^2) - 1) / m. This is
  // close to it: right in both limits, and computed in integers.
  const std::uint64_t ratio = (mean * (mean + of) << 16) / (2 * of * of + 2 * mean * of + mean * mean);
  std::array<std::uint64_t, 9> power = {65536};
  for (std::size_t i = 1; i < power.size(); ++i) power[i] = (power[i - 1] * ratio) >> 16;
  std::array<std::uint64_t, symbol_count> weight{};
  for (std::size_t s = 0; s < 15; ++s) weight[s] = power[s < 7 ? 7 - s : s - 7];
  weight[15] = (2 * power[8] << 16) / (65536 - ratio);
  std::uint64_t total = 0;
  for (const std::uint64_t w : weight) total += w;

  constexpr std::uint64_t least = 8;  // 2^-15, for each symbol
  SymbolModel model;
  std::uint64_t sum = 0;
  for (std::size_t s = 0; s < symbol_count; sum += weight[s++])
    model.below[s] = static_cast<std::int16_t>(sum * (32768 - least * symbol_count) / total + least * s);
  model.below[0] = start_age;
  return model;
}

}  // namespace tagrid
