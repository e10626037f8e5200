// Codes one quantized residual for the best effort: as a few binary events, each predicted in eight contexts.
// Two mixers weigh the eight predictions. Their mean is refined by the observed frequencies of such means
// (secondary estimation; both after M. Mahoney, "Adaptive weighing of context models for lossless data
// compression", 2005).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "stages/entropy/adaptive_bit.h"

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

inline constexpr std::size_t mixed_contexts = 8;

/// The number of values of each context.
inline constexpr std::array<std::uint32_t, mixed_contexts> mixed_context_sizes = {
    64 * 3 * 8, 32 * 8 * 8, 64 * 8 * 4, 4 * 81 * 8, 24 * 16 * 8, 15 * 15 * 16, 81 * 8 * 4, 64 * 8};

struct MixedContext {
  std::array<std::uint32_t, mixed_contexts> of;
  std::uint32_t energy;   ///< < 64: selects the first mixer's weights and the refinement
  std::uint32_t spread;   ///< < 256: selects the second mixer's weights
  std::int32_t low_bits;  ///< see EnergyClass
};

/// All adaptive state of one brick. About 3 MB.
class MixedResidualModel {
 public:
  MixedResidualModel();
  /// The heap of its tables.
  static constexpr std::uint64_t working_bytes() {
    std::uint64_t contexts = 0;
    for (const std::uint32_t size : mixed_context_sizes) contexts += size;
    return events * (contexts * sizeof(AdaptiveBit) + (64 + 256) * sizeof(MixerWeights) +
                     64 * sizeof(std::array<std::uint16_t, refinement_steps>));
  }

  /// Codes a residual of magnitude at most `largest`; decoded values keep this limit, too.
  template <class Coder>
  std::int32_t code(Coder& coder, std::int32_t residual, std::int32_t largest, const MixedContext& context);
  /// Codes the residual of a voxel whose neighbors are all equal.
  template <class Coder>
  [[gnu::noinline]] std::int32_t code_flat(Coder& coder, std::int32_t residual, std::int32_t largest) {
    const auto given = static_cast<std::uint64_t>(std::abs(residual));
    if (!code_adaptive(coder, given != 0, flat_differs_, 1000)) return 0;
    const std::uint64_t magnitude = 1 + flat_magnitude_.code(coder, given - 1);
    const auto limited = static_cast<std::int32_t>(std::min(magnitude, static_cast<std::uint64_t>(largest)));
    return code_adaptive(coder, residual < 0, flat_sign_, 250) ? -limited : limited;
  }

 private:
  // Events: zero; sign; magnitude beyond n; the two highest of the low bits, by the magnitude above them.
  static constexpr std::uint32_t zero = 0, sign = 1, beyond = 2, low = 16, events = 32;
  static constexpr std::uint32_t unary_limit = low - beyond;
  static constexpr std::size_t refinement_steps = 33;
  using MixerWeights = std::array<std::int32_t, mixed_contexts>;  ///< in 2^-16

  template <class Coder>
  bool code_event(Coder& coder, bool bit, std::uint32_t event, const MixedContext& context);

  std::array<std::vector<AdaptiveBit>, mixed_contexts> bits_;
  std::vector<MixerWeights> by_energy_, by_spread_;
  std::vector<std::array<std::uint16_t, refinement_steps>> refined_;
  IntegerModel far_;
  AdaptiveBit flat_differs_, flat_sign_;
  IntegerModel flat_magnitude_;
};

}  // namespace tagrid
