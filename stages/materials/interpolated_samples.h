// The field of a mesh with materials: samples, interpolated linearly along each axis.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// Positions in a mesh with materials count in these parts of half an edge H.
inline constexpr std::int64_t parts_per_point = std::int64_t{1} << 18;

/// The values at which one material ends and the next one begins, in rising order: a value is in material n if n
/// thresholds are at most the value.
struct Materials {
  std::vector<float> thresholds;

  std::uint8_t of(float value) const {
    std::uint8_t n = 0;
    for (const float t : thresholds) n = static_cast<std::uint8_t>(n + (value >= t));
    return n;
  }
  /// The value where an edge between two materials is cut: the threshold, or the mean of the first and the last one
  /// if other materials lie between. REQUIRES: a != b.
  float between(std::uint8_t a, std::uint8_t b) const {
    const float low = thresholds[std::min(a, b)], high = thresholds[std::max(a, b) - 1U];
    return low + (high - low) / 2;
  }
};

/// Samples around a brick, and how they lie in the lattice of a mesh: its point p is at the sample p * step.
struct InterpolatedSamples {
  Samples<float> samples;      ///< those of a box, counted from 0 in the volume
  Index3 dims;                 ///< of the volume
  std::array<double, 3> step;  ///< samples per point of the lattice

  /// Between which samples a position lies, and how far it is from the first one. Positions beyond the volume are
  /// those of its faces.
  struct Along {
    std::int64_t first = 0;
    float part = 0;
  };
  Along along(int axis, std::int64_t position) const {
    constexpr double scale = 1.0 / static_cast<double>(parts_per_point);
    const std::int64_t last = dims[axis] - 1;
    // The position is below 2^53, so this is one rounding, and the same number in every brick.
    const double x = std::clamp(static_cast<double>(position) * scale * step[static_cast<std::size_t>(axis)],
                                0.0, static_cast<double>(last));
    const std::int64_t first = std::min(static_cast<std::int64_t>(x), std::max<std::int64_t>(last - 1, 0));
    return {first, static_cast<float>(x - static_cast<double>(first))};
  }
  float at(const Along& x, const Along& y, const Along& z) const {
    const std::int64_t to_y = dims.y > 1 ? 1 : 0, to_z = dims.z > 1 ? 1 : 0, to_x = dims.x > 1 ? 1 : 0;
    const auto row = [&](std::int64_t j, std::int64_t k) {
      const float* const s = &samples.at({x.first, j, k});
      return s[0] + x.part * (s[to_x] - s[0]);
    };
    const auto plane = [&](std::int64_t k) {
      const float low = row(y.first, k);
      return low + y.part * (row(y.first + to_y, k) - low);
    };
    const float low = plane(z.first);
    return low + z.part * (plane(z.first + to_z) - low);
  }
  /// The value at a position in parts of the lattice. REQUIRES: the samples around it are in the box.
  float at(Index3 position) const {
    return at(along(0, position.x), along(1, position.y), along(2, position.z));
  }
};

}  // namespace tagrid
