// Wide samples as heights in voxels, which the accuracy criterion measures.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

namespace tagrid {

/// (sample - range_low) * field_scale, limited to a million voxels, as a multiple of 2^-20. Such multiples
/// are coarse enough for the stencils of curvature.h to be exact in doubles, and so the same everywhere. A
/// sample that is not finite gives a NaN; edges near it violate nothing.
template <class T>
std::vector<double> heights_of(std::span<const T> samples, double range_low, double field_scale) {
  constexpr double limit = 1 << 20, fine = 1 << 20;
  std::vector<double> heights(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double voxels = (static_cast<double>(samples[i]) - range_low) * field_scale;
    heights[i] = std::floor(std::clamp(voxels, -limit, limit) * fine + 0.5) / fine;
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(samples[i])) heights[i] = std::numeric_limits<double>::quiet_NaN();
  }
  return heights;
}

}  // namespace tagrid
