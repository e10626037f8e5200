// Codes the quantized coefficients of a brick: bands in the order of their shape, flags for blocks of 4 x 4 x 4
// zeros, and magnitudes as unary events. Each event is predicted in two contexts: the magnitudes around the
// coefficient and of its parent; and the magnitude that is expected from all that is known, with the orientation. Both
// are mixed, and the mean of the mixed and of an observed frequency is used, as in stages/values/best. Signs are mixed
// from two contexts of signs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/entropy/adaptive_bit.h"
#include "stages/values/transform/mixed_event.h"
#include "stages/values/transform/shape.h"
#include "stages/values/transform/start_tables.h"

namespace tagrid {

/// All adaptive state of one brick.
struct CoefficientModel {
  static constexpr std::size_t mixer_contexts = 12, refinement_classes = 16;

  CoefficientModel();

  std::array<std::array<AdaptiveBit, near_classes * near_classes>, magnitude_events> near;
  std::array<std::array<AdaptiveBit, expected_classes * orientations>, magnitude_events> expected;
  std::array<std::array<MixerWeights, mixer_contexts>, magnitude_events> weights;
  std::array<std::array<Refinement, refinement_classes>, magnitude_events> refined;
  std::array<AdaptiveBit, sign_contexts> sign;
  std::array<AdaptiveBit, far_sign_contexts> far_sign;
  std::array<MixerWeights, orientations> sign_weights;
  std::array<AdaptiveBit, band_contexts> zero_band;
  std::array<AdaptiveBit, block_contexts> active_block;
  IntegerModel means, far;
};

/// Codes the coefficients of a brick, in place. An encoder replaces them by what they are decoded as. Returns
/// false if the decoder has run out of bytes, or if the encoder gives up. REQUIRES: the coefficients of a decoder
/// are 0.
template <class Coder>
bool code_coefficients(Coder& coder, CoefficientModel& model, const TransformShape& shape,
                       std::span<std::int32_t> coefficients);

/// The heap that this takes.
std::uint64_t working_bytes_of_coefficients(Index3 size);

}  // namespace tagrid
