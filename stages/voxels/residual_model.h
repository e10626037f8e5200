// Codes one quantized residual in the context of its surroundings: as one of sixteen symbols, and extra bits
// if it is large. The probabilities of symbols are the mean of three models, each selected by a different
// context.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>

#include "stages/entropy/integer_model.h"
#include "stages/entropy/symbol_model.h"

namespace tagrid {

/// The logarithm of v + 1/2 in steps of 2^-m octaves, from 0 on: these are the upper bits of a float. Exact,
/// and without a branch. REQUIRES: v < 2^22, m is 1 or 2.
template <int m>
inline std::uint32_t log_scale(std::uint32_t v) {
  const auto bits = std::bit_cast<std::int32_t>(static_cast<float>(static_cast<std::int32_t>(v)) + 0.5f);
  return static_cast<std::uint32_t>(std::max((bits >> (23 - m)) - (127 << m), 0));
}

/// Classes of the size of the residuals around. `energy` is a sum of their magnitudes, with weights that sum
/// to 16; the class is its log_scale<2>.
struct EnergyClass {
  std::uint8_t of_8 = 0, of_4 = 0;  ///< coarser classes
  std::uint8_t low_bits = 0;        ///< bits of the residual that are nearly uniform
};
inline constexpr std::size_t energy_classes = 64;
extern const std::array<EnergyClass, energy_classes> energy_class_table;

/// The context of a residual. The numbers of contexts are limited by the tables below.
struct ResidualContext {
  std::uint32_t energy;   ///< size of the residuals around, and the sign of the left one
  std::uint32_t spread;   ///< differences of the voxels around, and size of their residuals
  std::uint32_t level;    ///< place in the range of the brick, size of the residuals, rounding
  std::int32_t low_bits;  ///< see EnergyClass
  bool flip;              ///< the residual is more likely negative
};
inline constexpr std::size_t energy_contexts = energy_classes * 3, spread_contexts = 32 * 8,
                             level_contexts = 64 * 16;

/// Residuals of voxels whose neighbours are all equal.
class FlatResidualModel {
 public:
  /// Codes the residual of a voxel whose neighbours are all equal.
  template <class Coder>
  [[gnu::noinline]] std::int32_t code_flat(Coder& coder, std::int32_t residual, std::int32_t largest) {
    const auto given = static_cast<std::uint64_t>(std::abs(residual));
    if (!code_adaptive(coder, given != 0, flat_differs_, 1000)) return 0;
    const std::uint64_t magnitude = 1 + flat_magnitude_.code(coder, given - 1);
    const auto limited = static_cast<std::int32_t>(std::min(magnitude, static_cast<std::uint64_t>(largest)));
    return code_adaptive(coder, residual < 0, flat_sign_, 250) ? -limited : limited;
  }

 private:
  AdaptiveBit flat_differs_, flat_sign_;
  IntegerModel flat_magnitude_;
};

/// Codes the residuals of all other voxels. `Distributions` codes a symbol by code(coder, symbol, context).
template <class Distributions>
class SymbolResidualModel : public FlatResidualModel {
 public:
  /// Codes a residual of magnitude at most `largest`; decoded values keep this limit, too, whatever the
  /// stream.
  template <class Coder>
  [[gnu::always_inline]] std::int32_t code(Coder& coder, std::int32_t residual, std::int32_t largest,
                                           const ResidualContext& context) {
    const int low_bits = context.low_bits;
    if (context.flip) residual = -residual;
    const std::int32_t high = residual >> low_bits;
    std::size_t symbol =
        static_cast<std::uint32_t>(high + 7) < 15u ? static_cast<std::size_t>(high + 7) : 15u;
    symbol = distributions_.code(coder, symbol, context);
    std::int32_t coded = static_cast<std::int32_t>(symbol) - 7;
    if (symbol == 15 || low_bits > 0) [[unlikely]] {
      if (symbol == 15) coded = code_far(coder, high);
      if (low_bits > 0) {
        const auto low = static_cast<std::uint32_t>(residual) & ((1u << low_bits) - 1);
        coded = static_cast<std::int32_t>(static_cast<std::uint32_t>(coded) << low_bits |
                                          coder.code_raw(low, low_bits));
      }
    }
    if constexpr (!Coder::encoding) coded = std::clamp(coded, -largest, largest);
    return context.flip ? -coded : coded;
  }

 private:
  /// Codes residuals without a symbol: those beyond -7 .. 7.
  template <class Coder>
  [[gnu::noinline]] std::int32_t code_far(Coder& coder, std::int32_t high) {
    const bool negative = coder.code_raw(high < 0, 1) != 0;
    const auto given = static_cast<std::uint64_t>(std::abs(std::int64_t{high}) - 8);
    // A brick of samples of 16 bits cannot have a larger residual.
    const auto far =
        static_cast<std::int32_t>(8 + std::min<std::uint64_t>(beyond_.code(coder, given), 1 << 18));
    return negative ? -far : far;
  }

  Distributions distributions_;
  IntegerModel beyond_;
};

/// The mean of three distributions, each selected by a different context. About 48 KB.
class ThreeDistributions {
 public:
  ThreeDistributions();

  template <class Coder>
  [[gnu::always_inline]] std::size_t code(Coder& coder, std::size_t symbol, const ResidualContext& context) {
    return code_symbol(coder, symbol, energy_[context.energy], spread_[context.spread],
                       level_[context.level]);
  }

 private:
  std::array<SymbolModel, energy_contexts> energy_;
  std::array<SymbolModel, spread_contexts> spread_;
  std::array<SymbolModel, level_contexts> level_;
};

/// A single distribution, for speed.
class OneDistribution {
 public:
  OneDistribution();

  template <class Coder>
  [[gnu::always_inline]] std::size_t code(Coder& coder, std::size_t symbol, const ResidualContext& context) {
    return code_symbol(coder, symbol, energy_[context.energy]);
  }

 private:
  std::array<SymbolModel, energy_contexts> energy_;
};

using ResidualModel = SymbolResidualModel<ThreeDistributions>;
using FastResidualModel = SymbolResidualModel<OneDistribution>;

}  // namespace tagrid
