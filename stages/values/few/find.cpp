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
#include "stages/values/few/table.h"
#include "stages/values/few/worth.h"

namespace tagrid {
namespace {

constexpr std::size_t widest_number = 65535;

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
