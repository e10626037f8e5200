#include "stages/values/points/field.h"

#include <array>
#include <cmath>
#include <limits>

#include "stages/grid/lattice.h"

namespace tagrid {

namespace {

// If one end is not finite, the other stands for both; if the sum is too large, halves are added.
template <class Number>
Number unusual_mean(Number a, Number b) {
  if (!std::isfinite(a)) return std::isfinite(b) ? b : std::numeric_limits<Number>::quiet_NaN();
  return std::isfinite(b) ? a * Number{0.5} + b * Number{0.5} : a;
}

template <class Number>
Number mean(Number a, Number b) {
  if constexpr (std::is_floating_point_v<Number>) {
    const Number sum = a + b;
    return std::isfinite(sum) ? sum * Number{0.5} : unusual_mean(a, b);
  }
  // No overflow: the K fractional bits leave room for a sum of two. Exact: see the top of the header.
  if constexpr (std::is_integral_v<Number>) return (a + b) >> 1;
}

// Handles the points first, first + step, ... below `end` of one row. Their base edges all run from `before`
// to `after`, which are offsets in the raster relative to the point.
template <class Number>
void fill_row(const std::uint64_t* bits, std::size_t first_bit, Number* row, std::int64_t first,
              std::int64_t end, std::int64_t step, std::int64_t reach) {
  for (std::int64_t x = first; x < end; x += step) {
    const std::size_t bit = first_bit + static_cast<std::size_t>(x);
    const Number between = mean(row[x - reach], row[x + reach]);
    row[x] = (bits[bit / 64] >> (bit % 64)) & 1 ? row[x] : between;
  }
}

// Handles all points of one unit with the same odd axes. The direction of a diagonal depends on the parities
// of the low corner of its cell, so each row has at most two kinds of points, which alternate.
template <class Number>
void fill_class(const LatticeBits& active, const Box& box, int cube_size, std::int64_t unit,
                std::array<bool, 3> odd, Number* values) {
  const Index3 size = box.size(), stride{1, size.x, size.x * size.y};
  const bool at_root = 2 * unit == cube_size;
  const auto start = [&](std::size_t axis) { return odd[axis] ? unit : 0; };
  const auto low_corner_is_odd = [&](std::int64_t at) { return !at_root && ((at - unit) & (2 * unit)) != 0; };
  const auto first_bit = static_cast<std::size_t>(box.low.x - active.box().low.x);
  for (std::int64_t z = start(2); z < size.z; z += 2 * unit)
    for (std::int64_t y = start(1); y < size.y; y += 2 * unit) {
      const std::uint64_t* bits = active.row(box.low.y + y, box.low.z + z);
      Number* row = values + z * stride.z + y * stride.y;
      const bool y_odd = low_corner_is_odd(y), z_odd = low_corner_is_odd(z);
      // `reach` leads from the point to the right end of its base edge.
      const std::int64_t y_reach = odd[1] ? unit * stride.y : 0, z_reach = odd[2] ? unit * stride.z : 0;
      if (!odd[0]) {
        const std::int64_t reach = odd[1] ? y_reach + (z_odd == y_odd ? z_reach : -z_reach) : z_reach;
        fill_row(bits, first_bit, row, 0, size.x, 2 * unit, reach);
        continue;
      }
      const auto reach_where = [&](bool x_odd) {
        return unit + (y_odd == x_odd ? y_reach : -y_reach) + (z_odd == x_odd ? z_reach : -z_reach);
      };
      fill_row(bits, first_bit, row, unit, size.x, 4 * unit, reach_where(false));
      fill_row(bits, first_bit, row, 3 * unit, size.x, 4 * unit, reach_where(!at_root));
    }
}

}  // namespace

template <class Number>
void interpolate(const LatticeBits& active, const Box& box, int cube_size, std::span<Number> values) {
  assert(active.box().contains(box));
  assert(values.size() == static_cast<std::size_t>(box.count()));
  for (int axis = 0; axis < 3; ++axis)
    assert(box.low[axis] % cube_size == 0 && box.high[axis] % cube_size == 0 && axis < 3);
  for (std::int64_t unit = cube_size / 2; unit >= 1; unit /= 2)
    for (int odd_axes = 3; odd_axes >= 1; --odd_axes)
      for (unsigned pattern = 1; pattern < 8; ++pattern) {
        const std::array<bool, 3> odd = {(pattern & 1) != 0, (pattern & 2) != 0, (pattern & 4) != 0};
        if (odd[0] + odd[1] + odd[2] == odd_axes)
          fill_class(active, box, cube_size, unit, odd, values.data());
      }
}

template void interpolate<std::int32_t>(const LatticeBits&, const Box&, int, std::span<std::int32_t>);
template void interpolate<std::int64_t>(const LatticeBits&, const Box&, int, std::span<std::int64_t>);
template void interpolate<double>(const LatticeBits&, const Box&, int, std::span<double>);

template <class T>
std::vector<FieldNumber<T>> interpolate_points(std::span<const T> points, const LatticeBits& active,
                                               int cube_size) {
  using Number = FieldNumber<T>;
  std::vector<Number> field(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if constexpr (std::is_integral_v<T>)
      field[i] = to_fixed<Number>(points[i], cube_size);
    else
      field[i] = points[i];
  }
  interpolate<Number>(active, active.box(), cube_size, field);
  return field;
}

template <class T>
std::vector<T> rounded_field(std::span<const FieldNumber<T>> field, std::span<const T> points,
                             const LatticeBits& active, int cube_size) {
  std::vector<T> samples(field.size());
  if constexpr (std::is_integral_v<T>) {
    round_to_samples<T, FieldNumber<T>>(field, cube_size, samples);
  } else {
    for (std::size_t i = 0; i < field.size(); ++i)
      samples[i] = std::isnan(field[i]) ? std::numeric_limits<T>::quiet_NaN() : static_cast<T>(field[i]);
    for_each_set(active, [&](Index3, std::size_t i) { samples[i] = points[i]; });
  }
  return samples;
}

LatticeBits prefix_of(const LatticeBits& active, int cube_size, int level) {
  LatticeBits prefix(active.box());
  for_each_set(active, [&](Index3 p, std::size_t) {
    if (classify(p, cube_size).level <= level) prefix.set(p);
  });
  return prefix;
}

#define TAGRID_INSTANTIATE(T)                                                                           \
  template std::vector<FieldNumber<T>> interpolate_points(std::span<const T>, const LatticeBits&, int); \
  template std::vector<T> rounded_field(std::span<const FieldNumber<T>>, std::span<const T>,            \
                                        const LatticeBits&, int);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
