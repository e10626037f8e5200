// Whether samples of few values take fewer bits as labels, as numbers of a table, or as multiples of a step.
// The estimates come from some rows of a brick.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

#include "stages/grid/box.h"

namespace tagrid {

/// Counts the samples of a row that are equal to none of those before them: left, above and behind.
template <class Bits>
std::size_t count_unlike(const Bits* row, const Bits* above, const Bits* behind, std::size_t count);

/// Bits of a sample, as an unsigned integer of its size.
template <class T>
using Bits =
    std::conditional_t<sizeof(T) == 1, std::uint8_t,
                       std::conditional_t<sizeof(T) == 2, std::uint16_t,
                                          std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>>;

/// Calls f with the offset of each row that is looked at: one of sixteen, spread over the brick, that has rows
/// above and behind it.
template <class F>
void for_some_rows(Index3 size, F f) {
  for (std::int64_t z = size.z > 1 ? 1 : 0; z < size.z; ++z)
    for (std::int64_t y = size.y > 1 ? 1 + (5 * z) % 16 : 0; y < size.y; y += 16)
      f(static_cast<std::size_t>((z * size.y + y) * size.x));
}

/// How far before a sample its neighbours lie: the one in the row above it, and the one in the slice behind it.
/// Where there is one row, or one slice, both are the same.
struct Neighbours {
  explicit Neighbours(Index3 size)
      : above(static_cast<std::size_t>(size.y > 1 ? size.x : size.x * size.y)),
        behind(size.z > 1 ? static_cast<std::size_t>(size.x * size.y) : above) {}
  std::size_t above, behind;
};

/// True if almost every sample has a neighbour before it that is equal.
template <class T>
bool are_like_labels(std::span<const T> samples, Index3 size) {
  if (size.y == 1 && size.z == 1) return false;
  const auto* const bits = reinterpret_cast<const Bits<T>*>(samples.data());
  const Neighbours before(size);
  const auto count = static_cast<std::size_t>(size.x);
  std::size_t seen = 0, unlike = 0;
  for_some_rows(size, [&](std::size_t at) {
    const Bits<T>* const row = bits + at;
    unlike += count_unlike(row, row - before.above, row - before.behind, count);
    seen += count - 1;
  });
  return unlike * 32 < seen;
}

/// True if samples take the fewest bits, about, as labels. Between a few objects they do. In noise amid what is
/// flat they do not: there most samples are unlike all neighbours, and near some of them. `value_steps`,
/// `number_steps`: see gain_of().
template <class ValueSteps, class NumberSteps>
bool labels_pay(Index3 size, std::size_t entries, ValueSteps value_steps, NumberSteps number_steps) {
  const Neighbours before(size);
  const std::int64_t bits_of_index = entries == 2 ? 0 : 3 + std::bit_width(entries - 1);
  std::int64_t as_values = 0, as_numbers = 0, as_labels = 0;
  for_some_rows(size, [&](std::size_t at) {
    for (std::size_t i = at + 1; i < at + static_cast<std::size_t>(size.x); ++i) {
      const std::array<std::uint64_t, 3> numbers = {number_steps(i - 1, i), number_steps(i - before.above, i),
                                                    number_steps(i - before.behind, i)};
      const auto [nearest, farthest] = std::minmax_element(numbers.begin(), numbers.end());
      if (*farthest == 0) continue;
      as_numbers += 1 + std::bit_width(*farthest);
      as_values += 1 + std::bit_width(std::max({value_steps(i - 1, i), value_steps(i - before.above, i),
                                                value_steps(i - before.behind, i)}));
      as_labels += 1 + (*nearest == 0 ? 0 : bits_of_index);
    }
  });
  return as_labels <= std::min(as_values, as_numbers);
}

/// An offset of a sample and of the next one, in steps that a few thousand samples are apart.
inline std::size_t stride_of(std::size_t samples) { return samples / 4096 | 1; }

/// Of narrow samples: true if most of some values have no other near them, so that residuals may be
/// smaller if they are numbered.
template <class T>
bool are_sparse(std::span<const T> samples, std::int64_t low, std::int64_t span, std::int64_t near) {
  std::array<std::uint64_t, 1024> seen;
  const auto words = static_cast<std::size_t>(span / 64 + 1);
  std::fill_n(seen.begin(), words, 0);
  const std::size_t stride = stride_of(samples.size());
  for (std::size_t i = 0; i < samples.size(); i += stride) {
    const auto value = static_cast<std::size_t>(samples[i] - low);
    seen[value / 64] |= std::uint64_t{1} << (value % 64);
  }
  std::size_t distinct = 0, dense = 0;
  std::int64_t last = std::numeric_limits<std::int32_t>::min();
  for (std::size_t word = 0; word < words; ++word)
    for (std::uint64_t left = seen[word]; left != 0; left &= left - 1) {
      const auto value = static_cast<std::int64_t>(word * 64) + std::countr_zero(left);
      dense += value - last <= near;
      ++distinct;
      last = value;
    }
  return 2 * dense <= distinct;
}

/// How many bits fewer residuals take, about, if samples are numbers. `value_steps`: how far apart two samples
/// are, in quantization steps; `numbers`: the same for numbers. They are looked at in some rows.
template <class ValueSteps, class NumberSteps>
std::int64_t gain_of(Index3 size, ValueSteps value_steps, NumberSteps number_steps) {
  std::int64_t gain = 0, seen = 0;
  for_some_rows(size, [&](std::size_t at) {
    for (std::size_t x = 1; x < static_cast<std::size_t>(size.x); ++x)
      gain +=
          std::bit_width(value_steps(at + x - 1, at + x)) - std::bit_width(number_steps(at + x - 1, at + x));
    seen += size.x;
  });
  return seen == 0 ? 0 : gain * (size.x * size.y * size.z / seen);
}

/// True if a gain pays for a table, and for what the estimate does not know.
inline bool pays(std::int64_t gain, std::int64_t bits_of_table, std::size_t samples) {
  return gain > bits_of_table + static_cast<std::int64_t>(samples / 16) + 256;
}

/// True if numbers that stand for multiples of `step` are quantized more coarsely than the samples would be.
inline bool affine_pays(std::int64_t step, std::int64_t error) {
  return step > 1 && (2 * (error / step) + 1) * step > 2 * error + 1;
}

}  // namespace tagrid
