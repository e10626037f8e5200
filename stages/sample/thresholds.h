// Values of which every decoded sample stays on its side.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "stages/sample/sample_type.h"

namespace tagrid {

inline constexpr std::size_t most_thresholds = 8;

/// A number for each threshold of a volume, in their order. All numbers but the first `count` are 0.
template <class Number>
struct OfThresholds {
  std::array<Number, most_thresholds> all{};
  std::size_t count = 0;

  std::span<const Number> numbers() const { return std::span(all).first(count); }
  void append(Number number) { all[count++] = number; }
  void add(const OfThresholds& other) {
    count = std::max(count, other.count);
    for (std::size_t i = 0; i < other.count; ++i) all[i] += other.all[i];
  }
  friend bool operator==(const OfThresholds&, const OfThresholds&) = default;
};

/// Values T of samples, increasing. A sample is on the upper side of T if it is at least T.
using Thresholds = OfThresholds<double>;

/// The least sample of a type that is at least `value`; nothing if none is, or if all are.
template <class T>
std::optional<T> threshold_of(double value) {
  using Limits = std::numeric_limits<T>;
  if (!(value > static_cast<double>(Limits::lowest()) && value <= static_cast<double>(Limits::max())))
    return {};
  if constexpr (Limits::is_integer) return static_cast<T>(std::ceil(value));
  const auto nearest = static_cast<T>(value);
  // -0 is not below 0.
  return (nearest < value ? std::nextafter(nearest, Limits::infinity()) : nearest) + T{0};
}
inline std::optional<double> threshold_of(double value, SampleType type) {
  std::optional<double> least;
  with_sample_type(type, [&](auto sample) {
    if (const auto found = threshold_of<decltype(sample)>(value)) least = static_cast<double>(*found);
  });
  return least;
}

/// The largest sample below a threshold.
template <class T>
T below_threshold(T threshold) {
  if constexpr (std::numeric_limits<T>::is_integer)
    return static_cast<T>(threshold - 1);
  else
    return std::nextafter(threshold, -std::numeric_limits<T>::infinity());
}

}  // namespace tagrid
