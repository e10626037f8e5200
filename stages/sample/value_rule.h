// Turns samples into the values that they mean, which may have another type.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>
#include <vector>

#include "stages/sample/sample_type.h"

namespace tagrid {

/// How samples become values: value = slope * sample + intercept, as numbers of another type.
struct ValueRule {
  SampleType from = SampleType::uint8, to = SampleType::uint8;
  /// One of all samples, or one for each slice along z of the entire volume; as many slopes as intercepts.
  std::vector<double> slopes = {1}, intercepts = {0};

  bool changes_nothing() const {
    return from == to && slopes.size() == 1 && slopes[0] == 1 && intercepts[0] == 0;
  }
  bool operator==(const ValueRule&) const = default;
};

/// A value that its type cannot hold.
struct ValueOutside {
  double value = 0;
};

/// Replaces `samples` by their values; `samples` become larger where the type of values is. They are slices
/// of `slice_samples` samples each, the first of which is slice `first_slice` of the volume. Integers become
/// integers exactly; values that are floats are computed in float64, and rounded to the nearest number of
/// their type. Integer values beyond their type are returned as the first one of them, and `samples` then
/// stay as they are. REQUIRES: integers become integers only with integer slopes and intercepts; these, and
/// slope * sample if the slope is not 1, are below 2^53. Floats become floats.
std::optional<ValueOutside> make_values(const ValueRule& rule, std::int64_t first_slice,
                                        std::int64_t slice_samples, std::vector<std::byte>& samples);

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
