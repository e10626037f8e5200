// The order in which the values of active points are coded, and their prediction: coarse to fine, every point
// from the vertices of its diamond, all of which are active and known by then.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// floor((2 a + b) / (2 b)): the nearest integer to a / b, halves up. REQUIRES: b > 0.
template <class Sum>
constexpr Sum rounded_quotient(Sum a, Sum b) {
  const Sum top = 2 * a + b, bottom = 2 * b;
  return top >= 0 ? top / bottom : -((bottom - 1 - top) / bottom);
}

/// Calls corner(at, before) for every corner of the root cubes of active.box(), in raster order. `at` is its
/// offset in the box; `before` is that of the previous corner along x, otherwise y, otherwise z, or -1 for
/// the first corner. Then calls point(p, unit, axes) for every other active point: level by level, and within
/// a level by `axes`, the axes (bits, x lowest) on which it is an odd multiple of `unit`. `more` is called
/// after every row; if it returns false, this function returns at once. REQUIRES: the box consists of whole
/// root cubes.
template <class Corner, class Point, class More>
bool for_points_coarse_to_fine(const LatticeBits& active, std::int64_t cube_size, Corner corner, Point point,
                               More more) {
  const Box& box = active.box();
  const Index3 size = box.size();
  const std::int64_t dy = size.x, dz = size.x * size.y, s = cube_size;
  for (std::int64_t z = 0; z < size.z; z += s)
    for (std::int64_t y = 0; y < size.y; y += s) {
      for (std::int64_t x = 0; x < size.x; x += s) {
        const std::int64_t at = x + y * dy + z * dz;
        corner(at, x > 0 ? at - s : y > 0 ? at - s * dy : z > 0 ? at - s * dz : -1);
      }
      if (!more()) return false;
    }

  std::vector<std::uint64_t> mask(active.words_per_row());
  const auto pass = [&](std::int64_t unit, unsigned axes) {
    const auto first = [&](int axis) { return axes >> axis & 1 ? unit : 0; };
    std::fill(mask.begin(), mask.end(), 0);
    for (std::int64_t x = first(0); x < size.x; x += 2 * unit)
      mask[static_cast<std::size_t>(x / 64)] |= std::uint64_t{1} << (x % 64);
    for (std::int64_t z = box.low.z + first(2); z <= box.high.z; z += 2 * unit)
      for (std::int64_t y = box.low.y + first(1); y <= box.high.y; y += 2 * unit) {
        const std::uint64_t* row = active.row(y, z);
        for (std::size_t i = 0; i < mask.size(); ++i)
          for (std::uint64_t rest = row[i] & mask[i]; rest != 0; rest &= rest - 1) {
            const auto x = static_cast<std::int64_t>(64 * i) + std::countr_zero(rest);
            point(Index3{box.low.x + x, y, z}, unit, axes);
          }
        if (!more()) return false;
      }
    return true;
  };
  for (std::int64_t unit = s / 2; unit >= 1; unit /= 2)
    for (int odd_axes = 3; odd_axes >= 1; --odd_axes)
      for (unsigned axes = 1; axes < 8; ++axes)
        if (std::popcount(axes) == odd_axes && !pass(unit, axes)) return false;
  return true;
}

/// The prediction of a point's value from the vertices of its diamond.
template <class Sum>
struct DiamondPrediction {
  Sum value = 0;
  std::int64_t low = std::numeric_limits<std::int64_t>::max(), high = ~low;  ///< of the vertices' values
  std::size_t kind = 0;  ///< 1 .. 3: cube centre, face centre, edge midpoint; 4 .. 6: the same at unit 1
};

inline constexpr std::size_t diamond_kinds = 7;  ///< 0 is for root corners

/// Predicts from the vertices of the diamond: the points one unit away along every even axis (those of them
/// that lie in `box`), and those with all combinations of signs along the odd axes. value_at(offset in the
/// box) is the known value of a vertex; Sum can hold 24 times such a value.
template <class Sum, class ValueAt>
[[gnu::always_inline]] inline DiamondPrediction<Sum> predict_from_diamond(const Box& box, Index3 p,
                                                                          std::int64_t unit, unsigned axes,
                                                                          ValueAt value_at) {
  const Index3 size = box.size();
  const std::int64_t at = box.offset(p), step[3] = {unit, unit * size.x, unit * size.x * size.y};
  DiamondPrediction<Sum> result;
  Sum corner_sum = 0, side_sum = 0, corners = 0, sides = 0;
  const auto see = [&](std::int64_t where) {
    const std::int64_t v = value_at(where);
    result.low = std::min(result.low, v);
    result.high = std::max(result.high, v);
    return Sum{v};
  };
  for (unsigned signs = 0; signs < 8; ++signs) {
    if ((signs & ~axes) != 0) continue;
    std::int64_t offset = 0;
    for (int axis = 0; axis < 3; ++axis)
      if (axes >> axis & 1) offset += (signs >> axis & 1) ? step[axis] : -step[axis];
    corner_sum += see(at + offset);
    ++corners;
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (axes >> axis & 1) continue;
    if (p[axis] > box.low[axis]) side_sum += see(at - step[axis]), ++sides;
    if (p[axis] < box.high[axis]) side_sum += see(at + step[axis]), ++sides;
  }
  // For a face centre, the sides are cube centres, which are closer than the corners: they weigh 2 : 1. An
  // edge midpoint takes the plain mean of its neighbors along the axes.
  if (sides == 0)
    result.value = rounded_quotient<Sum>(corner_sum, corners);
  else if (corners == 4)
    result.value = rounded_quotient<Sum>(corner_sum * sides + 2 * side_sum * corners, 3 * corners * sides);
  else
    result.value = rounded_quotient<Sum>(corner_sum + side_sum, corners + sides);
  result.kind = static_cast<std::size_t>(corners == 8 ? 1 : corners == 4 ? 2 : 3) + (unit == 1 ? 3 : 0);
  return result;
}

}  // namespace tagrid
