// What is known of coefficients before any is coded: trained on CT volumes at 37 to 52 dB
// (docs/dev/decisions/0049-transform.md). The tables are part of the format.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tagrid {

/// Events of a coefficient: e is whether its magnitude exceeds e.
inline constexpr std::size_t magnitude_events = 16;
/// Classes of magnitudes around a coefficient: of the neighbours, and of the parent.
inline constexpr std::size_t near_classes = 12;
inline constexpr std::size_t expected_classes = 32, orientations = 8;
inline constexpr std::size_t band_contexts = 56, block_contexts = 288;
/// Signs of three neighbours, with the orientation, in the finest level or not; and of others.
inline constexpr std::size_t sign_contexts = orientations * 27 * 2, far_sign_contexts = orientations * 81;

/// Magnitudes that an expected magnitude is a sum of: neighbours, parent, siblings.
inline constexpr std::size_t own_features = 16, features = 26;

/// Logits in 2^-4, that is in units of 16 for AdaptiveBit().
extern const std::array<std::array<std::int8_t, near_classes * near_classes>, magnitude_events> near_start;
extern const std::array<std::array<std::int8_t, expected_classes>, magnitude_events> expected_start;
extern const std::array<std::int8_t, band_contexts> band_start;
extern const std::array<std::int8_t, block_contexts> block_start;
extern const std::array<std::int8_t, sign_contexts> sign_start;
extern const std::array<std::int8_t, far_sign_contexts> far_sign_start;

/// In 2^-10, by orientation; from 8 on, of coefficients that are not of the finest level.
extern const std::array<std::array<std::int16_t, features>, 16> feature_weights;

}  // namespace tagrid
