// Codes one quantized residual for the best effort: as a few binary events, each predicted in eight contexts.
// Two mixers weigh the eight predictions. Their mean is refined by the observed frequencies of such means
// (secondary estimation; both after M. Mahoney, "Adaptive weighing of context models for lossless data
// compression", 2005).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "stages/values/best/residual_model.h"

namespace tagrid {

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
class MixedResidualModel : public FlatResidualModel {
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
};

}  // namespace tagrid
