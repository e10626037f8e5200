// Fits the weights of the filter after a transform (stages/values/transform/filter.h) to the errors of many bricks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// Of least squares: integers, so that the order of bricks does not matter.
struct FilterSums {
  /// Of two differences, of which the second one has the same number or a higher one.
  std::array<std::array<std::int64_t, filter_weights>, filter_weights> products{};
  std::array<std::int64_t, filter_weights> wanted{};  ///< of a difference and what its sample lacks

  void add(const FilterSums& other);
};

/// The weights for which what is lacking has the least squares, rounded; the same on every machine.
FilterWeights fitted_weights(const FilterSums& sums);

}  // namespace tagrid
