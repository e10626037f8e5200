// Adaptive probabilities of sixteen symbols, and the coding of a symbol by the mean of three of these models.
// A model is one vector of cumulative probabilities: mixing, searching and learning are a few operations on
// whole vectors (after J. Duda's and F. Giesen's adaptive models for rANS of small alphabets).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "stages/entropy/lanes.h"
#include "stages/entropy/rans_coder.h"

namespace tagrid {

inline constexpr std::size_t symbols = lane_count;

/// below[s]: the probability of a symbol less than s, in 2^-15, for s = 1 .. 15. below[0] is the model's age:
/// it approaches 32767 as fast as the probabilities approach the observed ones.
struct SymbolModel {
  Lanes below;
};
// glibc 2.36 does not use the holes of a heap for blocks of more alignment, so the heap would grow with every brick.
static_assert(alignof(SymbolModel) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__);

/// Age of a new model. Its initial probabilities count as some observations, so learning begins with 1/8.
inline constexpr std::int16_t start_age = 18432;

/// The content of a model in which one symbol is certain, except for the least probability that every symbol
/// keeps.
struct SymbolTargets {
  static constexpr int least = 4;  ///< 2^-15
  alignas(32) std::array<Lanes, symbols> of;

  constexpr SymbolTargets() : of{} {
    for (std::size_t s = 0; s < symbols; ++s)
      for (std::size_t i = 0; i < symbols; ++i)
        of[s][i] = static_cast<std::int16_t>(i == 0  ? 32767
                                             : i > s ? 32768 - static_cast<int>(symbols - i) * least
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

/// Moves a model towards the observed symbol. Two sums that differ by at least `least` continue to do so.
[[gnu::always_inline]] inline void learn(SymbolModel& model, std::size_t symbol) {
  const auto age = static_cast<std::uint16_t>(model.below[0]);
  move_towards(model.below, symbol_targets.of[symbol], learning_rates[age / 1024u]);
}

/// Codes a symbol by the mean of the probabilities of three models; the third one counts twice.
template <class Coder>
[[gnu::always_inline]] inline std::size_t code_symbol(Coder& coder, std::size_t symbol, SymbolModel& a,
                                                      SymbolModel& b, SymbolModel& c) {
  // Probability of a symbol less than s, in 2^-16.
  const auto mean_below = [&](std::size_t s) {
    const auto pair = static_cast<std::uint16_t>(a.below[s] + b.below[s]);
    return static_cast<std::uint16_t>((pair >> 1) + c.below[s]);
  };
  if constexpr (Coder::encoding) {
    const std::uint32_t start = symbol > 0 ? mean_below(symbol) : 0u;
    const std::uint32_t end = symbol + 1 < symbols ? mean_below(symbol + 1) : 65536u;
    coder.code_interval({static_cast<std::uint16_t>(start), static_cast<std::uint16_t>(end - start)});
  } else {
    const Boundaries below = mean(a.below, b.below, c.below);
    symbol = interval_of(static_cast<std::uint16_t>(coder.slot()), below);
    coder.advance(below[symbol], static_cast<std::uint16_t>(below[symbol + 1] - below[symbol]));
  }
  learn(a, symbol);
  learn(b, symbol);
  learn(c, symbol);
  return symbol;
}

/// Codes a symbol by the probabilities of one model.
template <class Coder>
[[gnu::always_inline]] inline std::size_t code_symbol(Coder& coder, std::size_t symbol, SymbolModel& a) {
  if constexpr (Coder::encoding) {
    const auto twice = [&a](std::size_t s) { return 2u * static_cast<std::uint32_t>(a.below[s]); };
    const std::uint32_t start = symbol > 0 ? twice(symbol) : 0u;
    const std::uint32_t end = symbol + 1 < symbols ? twice(symbol + 1) : 65536u;
    coder.code_interval({static_cast<std::uint16_t>(start), static_cast<std::uint16_t>(end - start)});
  } else {
    const Boundaries below = mean(a.below, a.below, a.below);
    symbol = interval_of(static_cast<std::uint16_t>(coder.slot()), below);
    coder.advance(below[symbol], static_cast<std::uint16_t>(below[symbol + 1] - below[symbol]));
  }
  learn(a, symbol);
  return symbol;
}

/// The initial model for residuals whose mean magnitude is `mean` / `of` (of > 0): a two-sided geometric
/// distribution around symbol 7, with the last symbol for everything beyond.
SymbolModel geometric_model(std::uint64_t mean, std::uint64_t of);

}  // namespace tagrid
