// How large residuals are around a voxel, and the coding of residuals where all neighbors are equal.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>

#include "stages/entropy/integer_model.h"

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

/// Residuals of voxels whose neighbors are all equal.
class FlatResidualModel {
 public:
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
  AdaptiveBit flat_differs_, flat_sign_;
  IntegerModel flat_magnitude_;
};

}  // namespace tagrid
