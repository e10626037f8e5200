#include "stages/values/transform/lifting.h"

#include <algorithm>
#include <array>
#include <cassert>

#include "stages/sample/vector_code.h"

namespace tagrid {

// Not in an unnamed namespace: see vector_code.h.

/// to += round(factor * (a + b)) or, to undo it, -=. Modulo 2^32, so that any coefficients are safe.
template <bool back>
TAGRID_INLINE void add_product(std::int32_t* to, const std::int32_t* a, const std::int32_t* b, std::int64_t n,
                               std::int32_t factor) {
  TAGRID_INDEPENDENT
  for (std::int64_t i = 0; i < n; ++i) {
    const auto sum =
        static_cast<std::int32_t>(static_cast<std::uint32_t>(a[i]) + static_cast<std::uint32_t>(b[i]));
    const auto product = static_cast<std::uint32_t>((std::int64_t{factor} * sum + (1 << 15)) >> 16);
    to[i] = static_cast<std::int32_t>(back ? static_cast<std::uint32_t>(to[i]) - product
                                           : static_cast<std::uint32_t>(to[i]) + product);
  }
}

// A function per direction: gcc clones no templates.
TAGRID_VECTOR_CODE void add_products(std::int32_t* to, const std::int32_t* a, const std::int32_t* b,
                                     std::int64_t n, std::int32_t factor) {
  add_product<false>(to, a, b, n, factor);
}
TAGRID_VECTOR_CODE void subtract_products(std::int32_t* to, const std::int32_t* a, const std::int32_t* b,
                                          std::int64_t n, std::int32_t factor) {
  add_product<true>(to, a, b, n, factor);
}

namespace {

// Those of the wavelet, rounded; of a constant, the third one leaves 1 of 180,000 parts in a high band.
struct LiftingStep {
  int to;               ///< 0: samples with even numbers, 1: with odd ones
  std::int32_t factor;  ///< in 2^-16
};
constexpr std::array<LiftingStep, 4> lifting_steps = {{{1, -103949}, {0, -3472}, {1, 57863}, {0, 29066}}};

constexpr std::int64_t columns_at_once = 64;

/// A line of vectors of `columns` numbers each, split into those with even and those with odd numbers: rows 0 .. low
/// and rows of the others, each with one more on either side for the mirror.
template <bool back>
void lift(std::int32_t* even, std::int32_t* odd, std::int64_t length, std::int64_t columns) {
  assert(length <= longest_line);
  const std::int64_t low = (length + 1) / 2, high = length / 2;
  const auto mirror = [&](std::int32_t* row, std::int64_t from, std::int64_t to) {
    std::copy_n(row + from * columns, columns, row + to * columns);
  };
  for (std::size_t i = 0; i < lifting_steps.size(); ++i) {
    const auto& [to, factor] = lifting_steps[back ? lifting_steps.size() - 1 - i : i];
    if (to == 1) {
      // Sample 2k + 1 lies between 2k and 2k + 2; after the last one comes its mirror image.
      mirror(even, low - 1, low);
      (back ? subtract_products : add_products)(odd, even, even + columns, high * columns, factor);
    } else {
      mirror(odd, 0, -1);
      if (low > high) mirror(odd, high - 1, high);
      (back ? subtract_products : add_products)(even, odd - columns, odd, low * columns, factor);
    }
  }
}

class Lines {
 public:
  std::int32_t* even() { return even_.data() + columns_at_once; }
  std::int32_t* odd() { return odd_.data() + columns_at_once; }

 private:
  static constexpr std::size_t size =
      static_cast<std::size_t>(((longest_line + 1) / 2 + 2) * columns_at_once);
  std::array<std::int32_t, size> even_, odd_;
};

/// Splits or joins the first `length` vectors of a line along y or z: vectors of `columns` numbers, `stride` apart.
template <bool back>
void lift_columns(std::int32_t* first, std::int64_t length, std::int64_t stride, std::int64_t columns,
                  Lines& lines) {
  const std::int64_t low = (length + 1) / 2;
  for (std::int64_t begin = 0; begin < columns; begin += columns_at_once) {
    const std::int64_t n = std::min(columns_at_once, columns - begin);
    std::int32_t* const at = first + begin;
    const auto copy = [&](std::int64_t from_line, std::int64_t number, bool to_line) {
      std::int32_t* const line = (from_line % 2 == 0 ? lines.even() : lines.odd()) + from_line / 2 * n;
      if (to_line)
        std::copy_n(at + number * stride, n, line);
      else
        std::copy_n(line, n, at + number * stride);
    };
    const auto place = [&](std::int64_t i) { return i % 2 == 0 ? i / 2 : low + i / 2; };
    for (std::int64_t i = 0; i < length; ++i) copy(i, back ? place(i) : i, true);
    lift<back>(lines.even(), lines.odd(), length, n);
    for (std::int64_t i = 0; i < length; ++i) copy(i, back ? i : place(i), false);
  }
}

template <bool back>
void lift_row(std::int32_t* row, std::int64_t length, Lines& lines) {
  const std::int64_t low = (length + 1) / 2, high = length / 2;
  std::int32_t *const even = lines.even(), *const odd = lines.odd();
  if constexpr (back) {
    std::copy_n(row, low, even);
    std::copy_n(row + low, high, odd);
  } else {
    for (std::int64_t i = 0; i < high; ++i) {
      even[i] = row[2 * i];
      odd[i] = row[2 * i + 1];
    }
    if (low > high) even[high] = row[2 * high];
  }
  lift<back>(even, odd, length, 1);
  if constexpr (back) {
    for (std::int64_t i = 0; i < high; ++i) {
      row[2 * i] = even[i];
      row[2 * i + 1] = odd[i];
    }
    if (low > high) row[2 * high] = even[high];
  } else {
    std::copy_n(even, low, row);
    std::copy_n(odd, high, row + low);
  }
}

/// The first numbers of the array along each axis.
template <bool back>
void lift_axis(std::span<std::int32_t> coefficients, Index3 size, Index3 part, int axis, Lines& lines) {
  const std::int64_t row = size.x, slice = size.x * size.y;
  std::int32_t* const all = coefficients.data();
  if (axis == 2)
    for (std::int64_t y = 0; y < part.y; ++y) lift_columns<back>(all + y * row, part.z, slice, part.x, lines);
  else
    for (std::int64_t z = 0; z < part.z; ++z) {
      if (axis == 1) lift_columns<back>(all + z * slice, part.y, row, part.x, lines);
      if (axis == 0)
        for (std::int64_t y = 0; y < part.y; ++y) lift_row<back>(all + z * slice + y * row, part.x, lines);
    }
}

/// What is left of an axis after some levels.
std::int64_t length_after(const TransformShape& shape, int axis, int levels) {
  return shape.lengths[static_cast<std::size_t>(axis)]
                      [static_cast<std::size_t>(std::min(levels, shape.levels(axis)))];
}

/// Level `level` along the axes 0 .. axes - 1 that have it. The other axes are whole.
template <bool back>
void lift_level(std::span<std::int32_t> coefficients, const TransformShape& shape, int level, int axes,
                Lines& lines) {
  Index3 part = shape.size;
  for (int axis = 0; axis < axes; ++axis) part[axis] = length_after(shape, axis, level);
  for (int i = 0; i < axes; ++i) {
    const int axis = back ? axes - 1 - i : i;
    if (level < shape.levels(axis)) lift_axis<back>(coefficients, shape.size, part, axis, lines);
  }
}

}  // namespace

void split_slices(std::span<std::int32_t> coefficients, const TransformShape& shape) {
  Lines lines;
  const int levels = std::max(shape.levels(0), shape.levels(1));
  for (int level = 0; level < levels; ++level) lift_level<false>(coefficients, shape, level, 2, lines);
}

void split_along_z(std::span<std::int32_t> coefficients, const TransformShape& shape, int level) {
  Lines lines;
  lift_axis<false>(coefficients, shape.size, {shape.size.x, shape.size.y, length_after(shape, 2, level)}, 2,
                   lines);
}

void join_along_z(std::span<std::int32_t> coefficients, const TransformShape& shape, int level) {
  Lines lines;
  lift_axis<true>(coefficients, shape.size, {shape.size.x, shape.size.y, length_after(shape, 2, level)}, 2,
                  lines);
}

void transform_forward(std::span<std::int32_t> coefficients, const TransformShape& shape) {
  if (shape.split != Split::dyadic) {
    split_slices(coefficients, shape);
    for (int level = 0; level < shape.levels(2); ++level) split_along_z(coefficients, shape, level);
    return;
  }
  Lines lines;
  const int levels = std::max({shape.levels(0), shape.levels(1), shape.levels(2)});
  for (int level = 0; level < levels; ++level) lift_level<false>(coefficients, shape, level, 3, lines);
}

void transform_back(std::span<std::int32_t> coefficients, const TransformShape& shape) {
  Lines lines;
  if (shape.split != Split::dyadic) {
    for (int level = shape.levels(2); level-- > 0;) join_along_z(coefficients, shape, level);
    for (int level = std::max(shape.levels(0), shape.levels(1)); level-- > 0;)
      lift_level<true>(coefficients, shape, level, 2, lines);
    return;
  }
  for (int level = std::max({shape.levels(0), shape.levels(1), shape.levels(2)}); level-- > 0;)
    lift_level<true>(coefficients, shape, level, 3, lines);
}

}  // namespace tagrid
