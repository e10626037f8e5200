#include "stages/values/wide/parameters.h"

#include <algorithm>
#include <limits>

#include "stages/entropy/adaptive_bit.h"
#include "stages/entropy/rans_coder.h"
#include "stages/sample/numbers.h"
#include "stages/sample/sample_type.h"
#include "stages/values/prediction/parameters.h"
#include "stages/values/wide/residual_model.h"

namespace tagrid {
namespace {

template <class T>
void make_keys(std::span<const T> samples, WideNumbers& n) {
  std::int64_t last = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    n.escaped[i] = !is_finite(samples[i]);
    if (!n.escaped[i]) last = key_of(samples[i]);
    n.numbers[i] = last;
  }
}

// Makes fixed-point numbers. Returns the number of finite samples that escape and differ from the last
// escaped one: only these take many bits.
template <class T>
std::size_t make_fixed(std::span<const T> samples, int exponent, bool exactly, WideNumbers& n) {
  const double unit = power_of_two(exponent), per_unit = power_of_two(-exponent);
  std::int64_t last = 0;
  std::size_t dear = 0;
  T last_escaped{};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double scaled = std::floor(static_cast<double>(samples[i]) * per_unit + 0.5);
    bool fits = std::fabs(scaled) <= static_cast<double>(largest_fixed);
    if (fits && exactly)
      fits = identical(from_fixed_point<T>(static_cast<std::int64_t>(scaled), unit), samples[i]);
    if (fits) last = static_cast<std::int64_t>(scaled);
    if (!fits && is_finite(samples[i]) && !identical(samples[i], last_escaped)) ++dear;
    if (!fits) last_escaped = samples[i];
    n.escaped[i] = !fits;
    n.numbers[i] = last;
  }
  return dear;
}

// Sum of the binary digits of the differences of neighbours in a row.
std::uint64_t roughness(const std::vector<std::int64_t>& numbers) {
  std::uint64_t digits = 0;
  for (std::size_t i = 1; i < numbers.size(); ++i)
    digits += static_cast<std::uint64_t>(std::bit_width(
        numbers[i] > numbers[i - 1]
            ? static_cast<std::uint64_t>(numbers[i]) - static_cast<std::uint64_t>(numbers[i - 1])
            : static_cast<std::uint64_t>(numbers[i - 1]) - static_cast<std::uint64_t>(numbers[i])));
  return digits;
}

// Lossless: fixed point if all finite samples are multiples of one unit and the result is shorter, as for
// integers stored as floats.
template <class T>
void choose_lossless(std::span<const T> samples, WideParameters& p, WideNumbers& n) {
  make_keys(samples, n);
  int lowest = highest_exponent, highest = lowest_exponent;
  for (const T v : samples)
    if (is_finite(v) && v != 0) {
      lowest = std::min(lowest, lowest_digit(v));
      highest = std::max(highest, std::ilogb(static_cast<double>(v)));
    }
  if (lowest < lowest_exponent || highest - lowest >= 46) return;
  WideNumbers fixed = n;
  make_fixed(samples, lowest, true, fixed);
  if (roughness(fixed.numbers) >= roughness(n.numbers)) return;
  p.fixed = true;
  p.exponent = lowest;
  n = std::move(fixed);
}

// Bounded: a unit far below the bound, but not below the last place of the largest sample. So multiples of it
// are samples, and nothing is rounded a second time.
template <class T>
void choose_bounded(std::span<const T> samples, const WideBounds& bounds, WideParameters& p, WideNumbers& n) {
  constexpr int digits_below_bound = 9;
  const double tight = bounds.surface_error > 0 ? bounds.surface_error : bounds.max_error;
  const int tight_exponent = std::ilogb(tight);
  int exponent = std::max(lowest_exponent, tight_exponent - digits_below_bound);
  for (const T v : samples) {
    if (!is_finite(v) || v == 0) continue;
    const int last = last_place(v), size = std::ilogb(static_cast<double>(v));
    if (last > tight_exponent || size - 45 > tight_exponent) continue;  // escapes
    exponent = std::max({exponent, last, size - 45});
  }
  exponent = std::min(exponent, highest_exponent);
  const auto error_in_units = [&](double bound) {
    const double units = std::floor(bound * power_of_two(-exponent) - 0.5);
    return static_cast<std::int64_t>(std::min(units, static_cast<double>(largest_fixed)));
  };
  p.error[0] = error_in_units(bounds.max_error);
  p.error[1] = bounds.surface_error > 0 ? error_in_units(bounds.surface_error) : 0;
  if (p.error[0] >= 0 && p.error[1] >= 0) {
    const std::size_t dear = make_fixed(samples, exponent, false, n);
    if (dear <= samples.size() / 8) {
      p.fixed = true;
      p.exponent = exponent;
      p.corrected = bounds.surface_error == 0;
      return;
    }
  }
  p.error = {};
  choose_lossless(samples, p, n);
}

}  // namespace

template <class T>
WideParameters choose_parameters(std::span<const T> samples, Index3 size, const WideBounds& bounds,
                                 WideNumbers& n) {
  WideParameters p;
  n.numbers.resize(samples.size());
  n.escaped.assign(samples.size(), 0);
  if constexpr (std::is_integral_v<T>) {
    make_keys(samples, n);
    const auto whole = [](double e) {
      return e < 0 ? 0 : static_cast<std::int64_t>(std::min(e, 4294967295.0));
    };
    p.error = {whole(bounds.max_error), whole(bounds.surface_error)};
  } else if (bounds.max_error > 0) {
    choose_bounded(samples, bounds, p, n);
  } else {
    choose_lossless(samples, p, n);
  }
  p.low = std::numeric_limits<std::int64_t>::max();
  p.high = std::numeric_limits<std::int64_t>::min();
  Int128 total = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (n.escaped[i]) {
      p.escapes = true;
      continue;
    }
    p.low = std::min(p.low, n.numbers[i]);
    p.high = std::max(p.high, n.numbers[i]);
    total += n.numbers[i];
    ++count;
  }
  if (count == 0) p.low = p.high = 0;
  if (count > 0) p.reference = static_cast<std::int64_t>(total / static_cast<std::int64_t>(count));
  const auto error = static_cast<double>(p.error[0]);
  const double noise = error * (error + 1) / 3;
  const std::span<const std::int64_t> numbers(n.numbers);
  constexpr auto unlimited = std::numeric_limits<std::int64_t>::max();
  p.first_slice = fit_weights(numbers, size, slice_taps, p.reference, unlimited, noise);
  p.others =
      size.z > 1 ? fit_weights(numbers, size, all_taps, p.reference, unlimited, noise) : default_weights();
  return p;
}

template <class T, class Coder>
bool code_wide_parameters(Coder& coder, bool two_bounds, WideParameters& p) {
  const auto signed_bits = [&coder](std::int64_t v) {
    return static_cast<std::int64_t>(code_raw_bits(coder, static_cast<std::uint64_t>(v), 64));
  };
  const auto flag = [&coder](bool v) { return coder.code_raw(v, 1) != 0; };
  std::int64_t least = std::numeric_limits<std::int64_t>::min(), most = ~least;
  if constexpr (std::is_floating_point_v<T>) {
    p.fixed = flag(p.fixed);
    if (p.fixed)
      p.exponent = static_cast<int>(
                       code_raw_bits(coder, static_cast<std::uint64_t>(p.exponent - lowest_exponent), 11)) +
                   lowest_exponent;
    p.escapes = flag(p.escapes);
    p.corrected = flag(p.corrected);
    if (p.exponent > highest_exponent || (p.corrected && !(p.fixed && two_bounds))) return false;
    if (p.fixed) least = -largest_fixed, most = largest_fixed;
    if (!p.fixed && sizeof(T) == 4) least = INT32_MIN, most = INT32_MAX;
  } else {
    least = std::numeric_limits<T>::min(), most = std::numeric_limits<T>::max();
  }
  for (std::size_t i = 0; i < (two_bounds ? 2 : 1); ++i)
    p.error[i] = static_cast<std::int64_t>(code_raw_bits(coder, static_cast<std::uint64_t>(p.error[i]), 48));
  if (!two_bounds) p.error[1] = p.error[0];
  p.low = signed_bits(p.low);
  p.high = signed_bits(p.high);
  p.reference = signed_bits(p.reference);
  IntegerModel model;
  code_weights(coder, model, p.first_slice, slice_taps);
  code_weights(coder, model, p.others, all_taps);
  return p.low >= least && p.high <= most && p.low <= p.reference && p.reference <= p.high &&
         p.error[0] <= largest_fixed && p.error[1] <= largest_fixed &&
         p.first_slice.magnitude() <= weight_limit && p.others.magnitude() <= weight_limit;
}

#define TAGRID_INSTANTIATE(T)                                                                             \
  template WideParameters choose_parameters(std::span<const T>, Index3, const WideBounds&, WideNumbers&); \
  template bool code_wide_parameters<T>(RansEncoder&, bool, WideParameters&);                             \
  template bool code_wide_parameters<T>(RansDecoder&, bool, WideParameters&);
TAGRID_FOR_EACH_WIDE_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
