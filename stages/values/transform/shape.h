// How a brick is split into bands by the wavelet: which axes are split how often, where the coefficients of a band
// lie, in which order bands are coded, and the step of each.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "stages/grid/box.h"

namespace tagrid {

/// Bricks have at most 512 samples along an axis, and the first one 513 without a lead.
inline constexpr std::int64_t longest_line = 513;

/// Numbers are part of the file format: never renumber.
enum class Split : std::uint8_t {
  dyadic = 0,  ///< each level splits the low band of the level before along all axes
  z1 = 1,      ///< all bands of slices, which are split along x and y, are also split along z, once
  z2 = 2,      ///< the same, and their low half once more
  z4 = 3,      ///< the same four times
};
inline constexpr int split_count = 4;

/// The most levels along an axis. An axis is split while it has at least four samples.
inline constexpr int most_levels = 6;

/// The bits after the point of coefficients: samples of 8 bits have more than samples of 16 bits, so that 32 bits
/// hold the coefficients.
constexpr int fraction_bits(std::size_t bytes_of_sample) { return bytes_of_sample == 1 ? 6 : 4; }

inline constexpr int no_band = -1;

struct Band {
  Index3 low, size;      ///< its box in the array of coefficients
  int level = 0;         ///< of its finest split along x and y, in a dyadic split also z; 1 is the finest
  int orientation = 0;   ///< 1, 2, 4: high along x, y, z
  bool is_mean = false;  ///< low along all axes
  /// Of its coefficients, in 2^-8 of their unit. By the axes along which a coefficient is the first or the last one:
  /// 1, 2, 4 for x, y, z.
  std::array<std::uint32_t, 8> steps;
  std::array<std::uint32_t, 8> finer;  ///< how many times smaller these are than the first one, in 2^-8
  int parent = no_band;                ///< the band of the next level with the same orientation
  Index3 parent_shift{};               ///< the parent of a coefficient is at its position >> this
  /// Bands that are coded before, whose coefficients belong to the same place; those along z may be half as long.
  std::array<int, 3> siblings = {no_band, no_band, no_band};
  std::array<int, 3> sibling_shift{};
};

struct TransformShape {
  Index3 size;
  Split split = Split::dyadic;
  /// lengths[axis][n]: of the low band after n splits.
  std::array<std::vector<std::int64_t>, 3> lengths;
  std::vector<Band> bands;  ///< in the order in which they are coded; the first one is that of means

  /// How often an axis is split; see Split.
  int levels(int axis) const { return static_cast<int>(lengths[static_cast<std::size_t>(axis)].size()) - 1; }
};

/// REQUIRES: size >= 1 along each axis, 1 <= step <= largest_transform_step.
TransformShape transform_shape(Index3 size, Split split, std::uint32_t step, int fraction_bits);

}  // namespace tagrid
