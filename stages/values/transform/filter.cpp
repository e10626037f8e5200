#include "stages/values/transform/filter.h"

#include <algorithm>
#include <bit>
#include <utility>
#include <vector>

#include "stages/sample/vector_code.h"

namespace tagrid {

// Not in an unnamed namespace: see vector_code.h.

TAGRID_INLINE std::int16_t limited(std::int16_t v, std::int16_t limit) {
  return std::min(std::max(v, static_cast<std::int16_t>(-limit)), limit);
}

/// Differences of a row to two rows of neighbours, limited at each level, added to three rows.
TAGRID_VECTOR_CODE void add_differences(const std::int16_t* here, const std::int16_t* one,
                                        const std::int16_t* other, std::size_t n, const std::int16_t* limits,
                                        std::int16_t* __restrict wide, std::int16_t* __restrict middle,
                                        std::int16_t* __restrict narrow) {
  const std::int16_t of_wide = limits[0], of_middle = limits[1], of_narrow = limits[2];
  TAGRID_INDEPENDENT
  for (std::size_t i = 0; i < n; ++i) {
    const auto a = static_cast<std::int16_t>(one[i] - here[i]),
               b = static_cast<std::int16_t>(other[i] - here[i]);
    wide[i] = static_cast<std::int16_t>(wide[i] + limited(a, of_wide) + limited(b, of_wide));
    middle[i] = static_cast<std::int16_t>(middle[i] + limited(a, of_middle) + limited(b, of_middle));
    narrow[i] = static_cast<std::int16_t>(narrow[i] + limited(a, of_narrow) + limited(b, of_narrow));
  }
}

// Not a loop: compilers that are told not to unroll loops would leave it as it is.
template <std::size_t... k>
TAGRID_INLINE std::int32_t weighted(const std::int16_t* differences, std::size_t stride,
                                    const std::int32_t* weights, std::index_sequence<k...>) {
  return (... + (differences[k * stride] * weights[k]));
}

TAGRID_VECTOR_CODE void add_corrections(const std::int16_t* differences, std::size_t stride, std::size_t n,
                                        const std::int16_t* weights, std::int32_t most, int shift,
                                        std::int32_t* __restrict values) {
  std::int32_t w[filter_weights];
  for (std::size_t k = 0; k < filter_weights; ++k) w[k] = weights[k];
  TAGRID_INDEPENDENT
  for (std::size_t i = 0; i < n; ++i) {
    const std::int32_t sum =
        512 + weighted(differences + i, stride, w, std::make_index_sequence<filter_weights>());
    const std::int32_t correction = std::min(std::max(sum >> 10, -most), most);
    values[i] = static_cast<std::int32_t>(static_cast<std::uint32_t>(values[i]) +
                                          (static_cast<std::uint32_t>(correction) << shift));
  }
}

TAGRID_VECTOR_CODE std::int64_t dot_product(const std::int16_t* a, const std::int16_t* b, std::size_t n) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < n; ++i) sum += std::int32_t{a[i]} * b[i];
  return sum;
}

namespace {

constexpr std::size_t groups = filter_weights / 3;
/// Neighbours whose differences share a weight. Of each there is the opposite one, too.
struct Neighbour {
  std::size_t group;
  int x, y, z;
};
constexpr std::array<Neighbour, 14> neighbours = {{{0, 1, 0, 0},
                                                   {1, 0, 1, 0},
                                                   {2, 0, 0, 1},
                                                   {3, 1, 1, 0},
                                                   {3, -1, 1, 0},
                                                   {4, 1, 0, 1},
                                                   {4, -1, 0, 1},
                                                   {4, 0, 1, 1},
                                                   {4, 0, -1, 1},
                                                   {5, 2, 0, 0},
                                                   {5, 0, 2, 0},
                                                   {6, 0, 0, 2},
                                                   {7, 2, 2, 0},
                                                   {7, -2, 2, 0}}};
constexpr std::int64_t reach = 2, planes = 2 * reach + 1;

/// Numbers of 16 bits that stand for values: a step has 64 to 127 of their units.
struct Scale {
  Scale(std::uint32_t step, int fraction_bits) {
    const std::uint64_t of_values = std::uint64_t{step} << fraction_bits >> 6;
    shift = std::max(static_cast<int>(std::bit_width(of_values)) - 7, 0);
    unit = static_cast<std::int32_t>(of_values >> shift);
    limits = {4095, static_cast<std::int16_t>(std::max(unit / 4, 1)),
              static_cast<std::int16_t>(std::max(unit / 12, 1))};
  }
  std::int16_t operator()(std::int32_t value) const {
    const std::int32_t rounded = shift == 0 ? value : (value >> shift) + (value >> (shift - 1) & 1);
    return static_cast<std::int16_t>(std::clamp(rounded, -8191, 8191));
  }

  int shift;
  std::int32_t unit;  ///< of the step
  std::array<std::int16_t, 3> limits;
};

/// Calls row(offset, differences, stride) for rows of a brick: those whose y and z add up to a multiple of `every`.
/// `values` may change in between.
template <class Row>
void for_rows(std::span<const std::int32_t> values, Index3 size, const Scale& scale, std::int64_t every,
              Row row) {
  const std::int64_t width = size.x + 2 * reach, plane = width * (size.y + 2 * reach);
  const auto n = static_cast<std::size_t>(size.x);
  std::vector<std::int16_t> window(static_cast<std::size_t>(planes * plane)), differences(filter_weights * n);
  const auto at = [&](std::int64_t y, std::int64_t z) {
    return window.data() + (z + planes) % planes * plane + (y + reach) * width + reach;
  };
  const auto load = [&](std::int64_t z) {
    for (std::int64_t y = -reach; y < size.y + reach; ++y) {
      const std::int32_t* from =
          values.data() + (z * size.y + std::clamp<std::int64_t>(y, 0, size.y - 1)) * size.x;
      std::int16_t* to = at(y, z);
      for (std::int64_t x = 0; x < size.x; ++x) to[x] = scale(from[x]);
      std::fill_n(to - reach, reach, to[0]);
      std::fill_n(to + size.x, reach, to[size.x - 1]);
    }
  };
  const auto repeat = [&](std::int64_t from, std::int64_t to) {
    std::copy_n(at(-reach, from) - reach, plane, at(-reach, to) - reach);
  };
  for (std::int64_t z = 0; z < std::min(reach, size.z); ++z) load(z);
  for (std::int64_t z = size.z; z < reach; ++z) repeat(size.z - 1, z);
  for (std::int64_t z = -reach; z < 0; ++z) repeat(0, z);
  for (std::int64_t z = 0; z < size.z; ++z) {
    if (z + reach < size.z)
      load(z + reach);
    else
      repeat(z + reach - 1, z + reach);
    for (std::int64_t y = 0; y < size.y; ++y) {
      if ((y + z) % every != 0) continue;
      std::fill(differences.begin(), differences.end(), std::int16_t{0});
      for (const Neighbour& of : neighbours)
        add_differences(at(y, z), at(y + of.y, z + of.z) + of.x, at(y - of.y, z - of.z) - of.x, n,
                        scale.limits.data(), differences.data() + of.group * n,
                        differences.data() + (of.group + groups) * n,
                        differences.data() + (of.group + 2 * groups) * n);
      row(static_cast<std::size_t>((z * size.y + y) * size.x), std::as_const(differences), n);
    }
  }
}

}  // namespace

void filter_brick(std::span<std::int32_t> values, Index3 size, std::uint32_t step, int fraction_bits,
                  const FilterWeights& weights) {
  const Scale scale(step, fraction_bits);
  for_rows(values, size, scale, 1, [&](std::size_t offset, const auto& differences, std::size_t n) {
    add_corrections(differences.data(), n, n, weights.data(), scale.unit, scale.shift,
                    values.data() + offset);
  });
}

void add_to_sums(std::span<const std::int32_t> values, std::span<const std::int32_t> lacking, Index3 size,
                 std::uint32_t step, int fraction_bits, FilterSums& sums) {
  const Scale scale(step, fraction_bits);
  std::vector<std::int16_t> wanted(static_cast<std::size_t>(size.x));
  for_rows(values, size, scale, 4, [&](std::size_t offset, const auto& differences, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) wanted[i] = scale(lacking[offset + i]);
    for (std::size_t a = 0; a < filter_weights; ++a) {
      const std::int16_t* of_a = differences.data() + a * n;
      sums.wanted[a] += dot_product(of_a, wanted.data(), n);
      for (std::size_t b = a; b < filter_weights; ++b)
        sums.products[a][b] += dot_product(of_a, differences.data() + b * n, n);
    }
  });
}

std::uint64_t working_bytes_of_filter(Index3 size) {
  const auto width = static_cast<std::uint64_t>(size.x + 2 * reach),
             rows = static_cast<std::uint64_t>(size.y + 2 * reach);
  return sizeof(std::int16_t) *
         (planes * width * rows + (filter_weights + 1) * static_cast<std::uint64_t>(size.x));
}

}  // namespace tagrid
