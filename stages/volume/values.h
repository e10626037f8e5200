// Numbers as values of sample types.
#pragma once

#include <limits>
#include <type_traits>

#include "stages/volume/sample_type.h"

namespace tagrid {

/// True if a sample of this type can have exactly this finite value; a float may round it.
inline bool is_value_of(SampleType type, double value) {
  return with_sample_type(type, [&](auto sample) {
    using S = decltype(sample);
    const bool in_range = value >= static_cast<double>(std::numeric_limits<S>::lowest()) &&
                          value <= static_cast<double>(std::numeric_limits<S>::max());
    if constexpr (std::is_floating_point_v<S>) return in_range;
    return in_range && value == static_cast<double>(static_cast<S>(value));
  });
}

}  // namespace tagrid
