#include "stages/sample/value_rule.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <type_traits>
#include <utility>

namespace tagrid {
namespace {

/// sample + add, exactly. False if a value is not one of its type.
template <class From, class To, class Wide>
bool shift(const From* from, To* to, std::size_t count, Wide add) {
  constexpr auto low = static_cast<Wide>(std::numeric_limits<To>::min()),
                 high = static_cast<Wide>(std::numeric_limits<To>::max());
  // Without a branch, so that compilers make vector code of it.
  bool fits = true;
  for (std::size_t i = 0; i < count; ++i) {
    const Wide value = static_cast<Wide>(from[i]) + add;
    fits &= value >= low && value <= high;
    to[i] = static_cast<To>(value);
  }
  return fits;
}

/// slope * sample + intercept, exactly. False if a value is not one of its type.
template <class From, class To>
bool multiply(const From* from, To* to, std::size_t count, double slope, double intercept) {
  constexpr auto low = static_cast<double>(std::numeric_limits<To>::min()),
                 high = static_cast<double>(std::numeric_limits<To>::max());
  for (std::size_t i = 0; i < count; ++i) {
    const double value = slope * static_cast<double>(from[i]) + intercept;
    if (!(value >= low && value <= high)) return false;
    to[i] = static_cast<To>(value);
  }
  return true;
}

template <class From, class To>
bool slice_of_integers(const From* from, To* to, std::size_t count, double slope, double intercept) {
  if (slope != 1) return multiply(from, to, count, slope, intercept);
  if constexpr (sizeof(From) <= 2 && sizeof(To) <= 2) {
    // Beyond this, no sum with a narrow sample fits a narrow type.
    constexpr double most = 1 << 18;
    return intercept >= -most && intercept <= most &&
           shift(from, to, count, static_cast<std::int32_t>(intercept));
  } else {
    return shift(from, to, count, static_cast<std::int64_t>(intercept));
  }
}

template <class From, class To>
void slice_of_floats(const From* from, To* to, std::size_t count, double slope, double intercept) {
  for (std::size_t i = 0; i < count; ++i)
    to[i] = static_cast<To>(slope * static_cast<double>(from[i]) + intercept);
}

template <class From, class To>
double first_outside(const From* from, std::size_t count, double slope, double intercept) {
  for (std::size_t i = 0; i < count; ++i)
    if (const double value = slope * static_cast<double>(from[i]) + intercept;
        value < static_cast<double>(std::numeric_limits<To>::min()) ||
        value > static_cast<double>(std::numeric_limits<To>::max()))
      return value;
  return intercept;
}

template <class From, class To>
std::optional<ValueOutside> make_values_of_types(const ValueRule& rule, std::size_t z,
                                                 std::size_t slice_samples, std::vector<std::byte>& samples) {
  const std::size_t count = samples.size() / sizeof(From);
  std::vector<std::byte> values(count * sizeof(To));
  const bool is_one = rule.slopes.size() == 1;
  const std::size_t at_once = is_one ? count : slice_samples;
  for (std::size_t i = 0; i < count; i += at_once, ++z) {
    const std::size_t entry = is_one ? 0 : z, n = std::min(at_once, count - i);
    const auto* from = reinterpret_cast<const From*>(samples.data()) + i;
    auto* to = reinterpret_cast<To*>(values.data()) + i;
    if constexpr (std::is_floating_point_v<To>) {
      slice_of_floats(from, to, n, rule.slopes[entry], rule.intercepts[entry]);
    } else if constexpr (std::is_integral_v<From>) {
      if (!slice_of_integers(from, to, n, rule.slopes[entry], rule.intercepts[entry]))
        return ValueOutside{first_outside<From, To>(from, n, rule.slopes[entry], rule.intercepts[entry])};
    }
  }
  samples = std::move(values);
  return std::nullopt;
}

}  // namespace

std::optional<ValueOutside> make_values(const ValueRule& rule, std::int64_t first_slice,
                                        std::int64_t slice_samples, std::vector<std::byte>& samples) {
  assert(rule.slopes.size() == rule.intercepts.size() && !rule.slopes.empty());
  assert(!is_float_type(rule.from) || is_float_type(rule.to));
  if (rule.changes_nothing()) return std::nullopt;
  return with_sample_type(rule.from, [&](auto from) {
    return with_sample_type(rule.to, [&](auto to) {
      return make_values_of_types<decltype(from), decltype(to)>(
          rule, static_cast<std::size_t>(first_slice), static_cast<std::size_t>(slice_samples), samples);
    });
  });
}

}  // namespace tagrid
