// Predicts a voxel from its causal neighborhood: a weighted sum, with weights fitted to the brick.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "stages/grid/box.h"

namespace tagrid {

struct Tap {
  int dx, dy, dz;
};

/// The neighbors that have a weight; all come before the voxel in raster order. The first two are in the row
/// of the voxel, the first eight in its slice.
inline constexpr std::array<Tap, 18> taps = {{{-1, 0, 0},
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
inline constexpr int row_taps = 2;
inline constexpr int slice_taps = 8;
inline constexpr int all_taps = static_cast<int>(taps.size());

inline constexpr int weight_bits = 11;                                        ///< fraction bits of a weight
inline constexpr std::int32_t weight_limit = std::int32_t{8} << weight_bits;  ///< of the sum of magnitudes

/// Weights in units of 2^-weight_bits; they apply to differences from a reference value.
struct Weights {
  std::array<std::int32_t, taps.size()> of_tap{};

  std::int32_t sum() const;
  std::int64_t magnitude() const;
  friend bool operator==(const Weights&, const Weights&) = default;
};

/// (left + above) / 2, used if nothing better is known.
Weights default_weights();

/// Least squares on the originals of a brick, with a penalty on the distance from `default_weights()`.
///   samples     the brick, x fastest, `size` samples along each axis
///   tap_count   slice_taps: fit the first slice alone; all_taps: fit the slices after it
///   reference   is subtracted from every sample
///   magnitude   the largest distance of a sample from the reference, or more
///   noise       variance of the decoder's values around the originals, in squared sample units
/// The computation uses exact integers, and + - * / and square roots of doubles in a fixed order, so weights
/// are the same on every machine. The result has magnitude() <= weight_limit. T: samples of 8 or 16 bits, or
/// std::int64_t for wide ones.
template <class T>
Weights fit_weights(std::span<const T> samples, Index3 size, int tap_count, std::int64_t reference,
                    std::int64_t magnitude, double noise);

}  // namespace tagrid
