#include "stages/values/few/find.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "stages/bound/bounds.h"
#include "stages/sample/numbers.h"
#include "stages/sample/sample_type.h"
#include "stages/sample/vector_code.h"
#include "stages/values/few/table.h"

namespace tagrid {

/// Counts the samples of a row that are equal to none of those before them: left, above and behind.
template <class Bits>
TAGRID_VECTOR_CODE std::size_t count_unlike(const Bits* row, const Bits* above, const Bits* behind,
                                            std::size_t count) {
  std::uint32_t unlike = 0;
  for (std::size_t x = 1; x < count; ++x)
    unlike += (row[x] != row[x - 1]) & (row[x] != above[x]) & (row[x] != behind[x]);
  return unlike;
}
template std::size_t count_unlike(const std::uint8_t*, const std::uint8_t*, const std::uint8_t*, std::size_t);
template std::size_t count_unlike(const std::uint16_t*, const std::uint16_t*, const std::uint16_t*,
                                  std::size_t);
template std::size_t count_unlike(const std::uint32_t*, const std::uint32_t*, const std::uint32_t*,
                                  std::size_t);
template std::size_t count_unlike(const std::uint64_t*, const std::uint64_t*, const std::uint64_t*,
                                  std::size_t);

namespace {

constexpr std::size_t widest_number = 65535;
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
std::size_t stride_of(std::size_t samples) { return samples / 4096 | 1; }

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
bool pays(std::int64_t gain, std::int64_t bits_of_table, std::size_t samples) {
  return gain > bits_of_table + static_cast<std::int64_t>(samples / 16) + 256;
}

/// True if numbers that stand for multiples of `step` are quantized more coarsely than the samples would be.
bool affine_pays(std::int64_t step, std::int64_t error) {
  return step > 1 && (2 * (error / step) + 1) * step > 2 * error + 1;
}

/// The fewest of ascending values such that each of all is within the bound of one of them; `number` receives
/// the number of that one for each. Values that are not finite stand for themselves.
template <class T>
std::vector<T> representatives(const std::vector<T>& values, double bound,
                               std::vector<std::uint16_t>& number) {
  number.resize(values.size());
  std::vector<T> result;
  for (std::size_t begin = 0, end; begin < values.size(); begin = end) {
    T middle = values[begin];
    end = begin + 1;
    for (; end < values.size() && bound > 0; ++end) {
      const T low = values[begin], high = values[end];
      if (!is_finite(low) || !is_finite(high)) break;
      T next;
      if constexpr (std::is_integral_v<T>) {
        if (std::int64_t{high} - low > 2 * integer_bound<T>(bound)) break;
        next = static_cast<T>(low + (std::int64_t{high} - low) / 2);
      } else {
        next = std::midpoint(low, high);
        if (!within(static_cast<double>(low), static_cast<double>(next), bound) ||
            !within(static_cast<double>(high), static_cast<double>(next), bound))
          break;
      }
      middle = next;
    }
    std::fill(number.begin() + static_cast<std::ptrdiff_t>(begin),
              number.begin() + static_cast<std::ptrdiff_t>(end), static_cast<std::uint16_t>(result.size()));
    result.push_back(middle);
  }
  return result;
}

std::uint64_t distance(std::int64_t a, std::int64_t b) {
  return a < b ? static_cast<std::uint64_t>(b) - static_cast<std::uint64_t>(a)
               : static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b);
}

template <class T>
std::optional<FewValues<T>> affine(std::span<const T> samples, std::int64_t low, std::int64_t step) {
  FewValues<T> few;
  few.kind = FewKind::affine;
  few.first = static_cast<T>(low);
  few.step = static_cast<std::uint32_t>(step);
  few.numbers.resize(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    few.numbers[i] = static_cast<std::uint16_t>((samples[i] - low) / step);
  return few;
}

/// Samples of 8 or 16 bits: their values are marked in an array.
template <class T>
std::optional<FewValues<T>> find_few_narrow(std::span<const T> samples, Index3 size, const FewBounds& bounds,
                                            std::int64_t low, std::int64_t high) {
  const std::int64_t span = high - low, error = integer_bound<T>(bounds.loose), step = 2 * error + 1;
  const bool like_labels = are_like_labels(samples, size);
  if (!like_labels && !are_sparse(samples, low, span, step)) return {};
  std::vector<std::uint8_t> marks(static_cast<std::size_t>(span) + 1);
  for (const T v : samples) marks[static_cast<std::size_t>(v - low)] = 1;
  std::vector<T> values;
  std::int64_t common = 0;
  for (std::int64_t v = 0; v <= span; ++v)
    if (marks[static_cast<std::size_t>(v)] != 0) {
      values.push_back(static_cast<T>(low + v));
      common = std::gcd(common, v);
    }
  if (values.size() > most_entries(samples.size())) return {};
  FewValues<T> few;
  std::vector<std::uint16_t> number;
  few.entries = representatives(values, bounds.tight, number);
  std::vector<std::uint16_t> number_of(static_cast<std::size_t>(span) + 1);
  for (std::size_t i = 0; i < values.size(); ++i)
    number_of[static_cast<std::size_t>(values[i] - low)] = number[i];
  const auto number_at = [&](std::size_t i) { return number_of[static_cast<std::size_t>(samples[i] - low)]; };
  const auto value_steps = [&](std::size_t a, std::size_t b) {
    return (distance(samples[a], samples[b]) + static_cast<std::uint64_t>(error)) /
           static_cast<std::uint64_t>(step);
  };
  const auto number_steps = [&](std::size_t a, std::size_t b) {
    return distance(number_at(a), number_at(b));
  };
  if (like_labels && few.entries.size() > 1 &&
      labels_pay(size, few.entries.size(), value_steps, number_steps)) {
    few.kind = FewKind::labels;
  } else {
    if (like_labels && !are_sparse(samples, low, span, step)) return {};
    if (affine_pays(common, error) && 2 * static_cast<std::int64_t>(values.size()) >= span / common)
      return affine(samples, low, common);
    if (2 * step * static_cast<std::int64_t>(values.size()) > span && common == 1 && error == 0) return {};
    if (few.entries.size() < 2) return {};
    const auto entries = static_cast<std::int64_t>(few.entries.size());
    const std::int64_t bits = entries * (std::bit_width(static_cast<std::uint64_t>(span / entries)) + 2);
    if (!pays(gain_of(size, value_steps, number_steps), bits, samples.size())) return {};
  }
  few.numbers.resize(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    few.numbers[i] = number_of[static_cast<std::size_t>(samples[i] - low)];
  return few;
}

/// Different values, in the order in which they are met. Open addressing.
template <class T>
class ValueSet {
 public:
  explicit ValueSet(std::size_t most) : most_(most), slots_(std::bit_ceil(2 * most)) {
    shift_ = 64 - std::bit_width(slots_.size() - 1);
  }

  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  /// The number of a value. None if there are more than `most` values, or many that collide.
  std::uint32_t number_of(BitsOf<T> value) {
    std::size_t at = static_cast<std::size_t>(std::uint64_t{value} * 0x9E3779B97F4A7C15u >> shift_);
    for (int tries = 0; tries < 256; ++tries, at = (at + 1) & (slots_.size() - 1)) {
      Slot& slot = slots_[at];
      if (slot.next == 0) {
        if (values_.size() == most_) return none;
        values_.push_back(std::bit_cast<T>(value));
        slot.value = value;
        slot.next = static_cast<std::uint32_t>(values_.size());
      }
      if (slot.value == value) return slot.next - 1;
    }
    return none;
  }

  const std::vector<T>& values() const { return values_; }

  struct Slot {
    BitsOf<T> value;
    std::uint32_t next;  ///< its number, plus one; 0: the slot is free
  };

 private:
  std::size_t most_;
  std::vector<Slot> slots_;
  std::vector<T> values_;
  int shift_;
};

/// True if some samples have common values.
template <class T>
bool may_be_few(std::span<const T> samples) {
  const std::size_t stride = stride_of(samples.size()), looked_at = (samples.size() + stride - 1) / stride;
  ValueSet<T> set(looked_at);
  std::size_t repeated = 0, seen = 0;
  std::size_t before = 0;
  for (std::size_t i = 0; i < samples.size(); i += stride, ++seen) {
    const std::uint32_t number = set.number_of(bits_of(samples[i]));
    repeated += set.values().size() == before;
    before = set.values().size();
    if (number == ValueSet<T>::none) return false;
    // Of 1024 samples of 2^16 values, eight are met again.
    if (seen == 1024 && repeated < 2) return false;
  }
  return repeated * 64 >= looked_at;
}

/// The common step of integers, if they are then numbers of 16 bits.
template <class T>
std::int64_t common_step(std::span<const T> samples, std::int64_t& low) {
  std::int64_t step = 0, highest = samples[0];
  low = samples[0];
  for (const T v : samples) {
    const std::int64_t difference = v - std::int64_t{samples[0]};
    if (step == 0 || difference % step != 0) step = std::gcd(step, difference);
    if (step == 1) return 0;
    low = std::min<std::int64_t>(low, v);
    highest = std::max<std::int64_t>(highest, v);
  }
  return step > 0 && (highest - low) / step <= static_cast<std::int64_t>(widest_number) ? step : 0;
}

/// Samples of 32 or 64 bits.
template <class T>
std::optional<FewValues<T>> find_few_wide(std::span<const T> samples, Index3 size, const FewBounds& bounds) {
  const bool like_labels = are_like_labels(samples, size);
  std::int64_t error = 0;
  if constexpr (std::is_integral_v<T>) {
    error = integer_bound<T>(bounds.loose);
    std::int64_t low = 0;
    const std::int64_t step = like_labels ? 0 : common_step(samples, low);
    if (affine_pays(step, error)) return affine(samples, low, step);
  }
  if (!like_labels && !may_be_few(samples)) return {};
  ValueSet<T> set(most_entries(samples.size()));
  FewValues<T> few;
  few.numbers.resize(samples.size());
  BitsOf<T> last = ~bits_of(samples[0]);
  std::uint32_t last_number = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const BitsOf<T> bits = bits_of(samples[i]);
    if (bits != last) {
      last_number = set.number_of(bits);
      if (last_number == ValueSet<T>::none) return {};
      last = bits;
    }
    few.numbers[i] = static_cast<std::uint16_t>(last_number);
  }
  std::vector<std::uint16_t> order(set.values().size()), number;
  std::iota(order.begin(), order.end(), std::uint16_t{0});
  const auto key = [&](std::size_t i) { return key_of(set.values()[i]); };
  std::sort(order.begin(), order.end(), [&](std::uint16_t a, std::uint16_t b) { return key(a) < key(b); });
  std::vector<T> values;
  values.reserve(order.size());
  for (const std::uint16_t i : order) values.push_back(set.values()[i]);
  few.entries = representatives(values, bounds.tight, number);
  if (few.entries.size() < 2) return {};
  std::vector<std::uint16_t> number_of(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) number_of[order[i]] = number[i];
  for (std::uint16_t& n : few.numbers) n = number_of[n];
  const auto number_steps = [&](std::size_t a, std::size_t b) {
    return distance(few.numbers[a], few.numbers[b]);
  };
  [[maybe_unused]] const double per_step = bounds.loose > 0 ? 0.5 / bounds.loose : 0;
  const auto value_steps = [&](std::size_t a, std::size_t b) {
    if constexpr (std::is_floating_point_v<T>) {
      if (per_step == 0) return distance(key_of(samples[a]), key_of(samples[b]));
      const double steps =
          std::fabs(static_cast<double>(samples[a]) - static_cast<double>(samples[b])) * per_step;
      return steps < 0x1p62 ? static_cast<std::uint64_t>(steps) : std::uint64_t{1} << 62;
    } else {
      const auto step = static_cast<std::uint64_t>(2 * error + 1);
      return (distance(samples[a], samples[b]) + static_cast<std::uint64_t>(error)) / step;
    }
  };
  if (like_labels && labels_pay(size, few.entries.size(), value_steps, number_steps)) {
    few.kind = FewKind::labels;
    return few;
  }
  // An entry takes no more than the bits of its distance, and often much less.
  std::int64_t bits = 0;
  for (std::size_t i = 1; i < few.entries.size(); ++i)
    bits += 2 + std::bit_width(distance(key_of(few.entries[i]), key_of(few.entries[i - 1])));
  if (!pays(gain_of(size, value_steps, number_steps), bits, samples.size())) return {};
  return few;
}

}  // namespace

template <class T>
std::optional<FewValues<T>> find_few(std::span<const T> samples, Index3 size, const FewBounds& bounds,
                                     [[maybe_unused]] T low, [[maybe_unused]] T high) {
  if constexpr (is_wide<T>)
    return find_few_wide(samples, size, bounds);
  else
    return find_few_narrow(samples, size, bounds, low, high);
}

std::uint64_t bytes_of_few(std::uint64_t samples, std::size_t bytes) {
  return samples * sizeof(std::uint16_t) + most_entries(samples) * bytes;
}
std::uint64_t working_bytes_of_finding_few(std::uint64_t samples, std::size_t bytes) {
  const std::uint64_t entries = most_entries(samples);
  // Vectors that grow have their old content beside the new one.
  if (bytes <= 2) {
    const std::uint64_t values = std::uint64_t{1} << (8 * bytes);
    return samples * 2 + values * (1 + 2) + std::min(values, samples) * (3 * bytes + 2 + 3 * bytes);
  }
  const std::uint64_t slot = bytes == 8 ? sizeof(ValueSet<double>::Slot) : sizeof(ValueSet<float>::Slot);
  return samples * 2 + std::bit_ceil(2 * std::max<std::uint64_t>(entries, 4097)) * slot +
         entries * (3 * bytes + bytes + 3 * bytes + 3 * 2);
}

#define TAGRID_INSTANTIATE(T) \
  template std::optional<FewValues<T>> find_few(std::span<const T>, Index3, const FewBounds&, T, T);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
