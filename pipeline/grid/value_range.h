// The range of the finite samples of a brick or of a volume.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "stages/sample/sample_type.h"

namespace tagrid {

struct ValueRange {
  double low = INFINITY, high = -INFINITY;
  std::uint64_t finite = 0;  ///< how many samples are finite

  void add(const ValueRange& other) {
    low = std::min(low, other.low);
    high = std::max(high, other.high);
    finite += other.finite;
  }
};

inline ValueRange value_range(std::span<const std::byte> samples, SampleType type) {
  return with_sample_type(type, [&](auto sample) {
    using T = decltype(sample);
    const std::span all(reinterpret_cast<const T*>(samples.data()), samples.size() / sizeof(T));
    ValueRange range;
    if constexpr (std::is_integral_v<T>) {
      if (all.empty()) return range;
      const auto [low, high] = std::minmax_element(all.begin(), all.end());
      range = {static_cast<double>(*low), static_cast<double>(*high), all.size()};
    } else {
      for (const T v : all) {
        if (!std::isfinite(v)) continue;
        ++range.finite;
        range.low = std::min(range.low, static_cast<double>(v));
        range.high = std::max(range.high, static_cast<double>(v));
      }
    }
    return range;
  });
}

}  // namespace tagrid
