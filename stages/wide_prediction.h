// Linear prediction of the numbers of wide samples from up to 18 earlier neighbours, its weights fitted to
// the brick by least squares.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "grid/box.h"

namespace tagrid {

struct WideTap {
  int dx, dy, dz;
};

/// The neighbours, in the order of the file format; the first 8 lie in the same slice.
inline constexpr std::array<WideTap, 18> wide_taps = {{{-1, 0, 0},
                                                       {-2, 0, 0},
                                                       {0, -1, 0},
                                                       {-1, -1, 0},
                                                       {1, -1, 0},
                                                       {2, -1, 0},
                                                       {-2, -1, 0},
                                                       {0, -2, 0},
                                                       {0, 0, -1},
                                                       {-1, 0, -1},
                                                       {1, 0, -1},
                                                       {0, -1, -1},
                                                       {0, 1, -1},
                                                       {-1, -1, -1},
                                                       {1, -1, -1},
                                                       {-1, 1, -1},
                                                       {1, 1, -1},
                                                       {0, 0, -2}}};
inline constexpr std::size_t wide_slice_taps = 8;

/// Weights of the taps in 2^-11.
inline constexpr int wide_weight_bits = 11;
using WideWeights = std::array<std::int32_t, 18>;
/// Sums of magnitudes of weights are at most this.
inline constexpr std::int64_t wide_weight_limit = 16384;

/// (left + above) / 2.
constexpr WideWeights default_wide_weights() {
  WideWeights weights{};
  weights[0] = weights[2] = 1 << (wide_weight_bits - 1);
  return weights;
}

std::int64_t magnitude_of(const WideWeights& weights);

/// Fits the first `tap_count` (8 or 18) weights to the numbers of a box of `size`, x fastest; 8: to its first
/// slice. `noise` is the variance of the difference between decoded and original numbers. The same weights on
/// every machine; magnitude_of() them is at most wide_weight_limit.
WideWeights fit_wide_weights(std::span<const std::int64_t> numbers, Index3 size, std::size_t tap_count,
                             std::int64_t reference, double noise);

}  // namespace tagrid
