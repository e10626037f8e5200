// Tests whether the linear interpolation in a tetrahedron is near enough to all samples in it.
//
// The barycentric weights of lattice points in a tetrahedron whose base edge has the midpoint p are multiples
// of 1/2u, where u is the unit of p (see stages/criterion/diamond_samples.h). So 2u times the interpolation
// is a whole number for integers, and is compared with 2u times the sample.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <type_traits>

#include "stages/coarsen/coarsen.h"
#include "stages/grid/lattice.h"
#include "stages/mesh/cut.h"
#include "stages/sample/numbers.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// The weights of the vertices at a lattice point, times 2u: value[i] at `origin`, and its growth along each
/// axis.
struct LeafWeights {
  Index3 origin;
  std::array<std::int64_t, 4> value{};
  std::array<Index3, 4> growth{};

  std::array<std::int64_t, 4> at(Index3 p) const {
    std::array<std::int64_t, 4> weights;
    for (std::size_t i = 0; i < 4; ++i) weights[i] = value[i] + dot(growth[i], p - origin);
    return weights;
  }
};

/// REQUIRES: `vertices` are those of a positive tetrahedron of the hierarchy that is not of the last level;
/// `unit` is that of the midpoint of its base edge.
constexpr LeafWeights weights_in(const std::array<Index3, 4>& vertices, std::int64_t unit) {
  // Each weight is 0 on the face of the other vertices, which are in this order so that it grows inwards.
  constexpr std::array<std::array<std::size_t, 3>, 4> faces = {{{1, 3, 2}, {0, 2, 3}, {0, 3, 1}, {0, 1, 2}}};
  LeafWeights weights;
  weights.origin = vertices[0];
  const std::int64_t part = six_volumes(vertices) / (2 * unit);  // exact: both are powers of two
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& f = faces[i];
    const Index3 normal = cross(vertices[f[1]] - vertices[f[0]], vertices[f[2]] - vertices[f[0]]);
    weights.growth[i] = {normal.x / part, normal.y / part, normal.z / part};
  }
  weights.value[0] = 2 * unit;
  return weights;
}

/// What samples of integers may differ: exact.
template <class T>
class IntegerLimit {
 public:
  using Number = std::conditional_t<is_wide<T>, std::int64_t, std::int32_t>;

  explicit IntegerLimit(double largest) : largest_(std::min(largest, most)) {}

  /// The largest allowed difference, times an integer.
  std::int64_t times(std::int64_t whole) const {
    // largest_ is mantissa * 2^exponent.
    int exponent = 0;
    const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(largest_, &exponent), 53));
    exponent -= 53;
    const Int128 product = Int128{mantissa} * whole;
    return exponent < -126 ? 0 : static_cast<std::int64_t>(product >> -exponent);
  }

 private:
  // No two samples differ by more.
  static constexpr double most = is_wide<T> ? 0x1p32 : 0x1p16;
  double largest_;
};

/// Tests leaves of one box of samples. T: the type of samples.
template <class T>
class LeafTest {
 public:
  LeafTest(const Samples<T>& samples, const MeshBound& bound)
      : samples_(samples), bound_(bound), volume_(bound.volume), limit_(bound.largest) {}

  /// True if a sample of the volume in the tetrahedron, its border included, is further from the
  /// interpolation than the bound. If the mesh is cut at the border of the volume, the interpolation is that
  /// in the pieces. REQUIRES: a tetrahedron of the hierarchy, positive and not of the last level, whose
  /// vertices have samples; `middle` is the midpoint of its base edge from `left` to `right`, and `unit` its
  /// unit.
  bool violates(const std::array<Index3, 4>& vertices, const BaseEdge& edge, Index3 middle,
                std::int64_t unit) const {
    const bool cut = !bound_.padded && reaches_beyond(vertices, volume_);
    if constexpr (std::is_integral_v<T>) {
      if (cut) return violates_in_pieces(vertices, unit);
      const std::int64_t allowed = limit_.times(2 * unit);
      // Most violations are found here, and tetrahedra of the last level but one have no other sample inside.
      if (volume_.contains(middle)) {
        const std::int64_t twice = 2 * number(middle) - number(edge.left) - number(edge.right);
        if (std::abs(twice) * unit > allowed) return true;
        if (unit == 1 && is_axis_parallel(edge)) return false;
      }
      return integers_violate(vertices, unit, allowed);
    } else {
      return floats_violate(vertices, unit, cut);
    }
  }

 private:
  static constexpr bool is_axis_parallel(const BaseEdge& e) {
    const Index3 d = e.right - e.left;
    return (d.x != 0) + (d.y != 0) + (d.z != 0) == 1;
  }
  std::int64_t number(Index3 p) const { return static_cast<std::int64_t>(samples_.at(p)); }

  // Calls row(first point, weights there, growth of weights along x, number of points) for the samples of the
  // volume in the tetrahedron until it returns true. Weights grow by at most 2.
  template <class Row>
  bool any_row(const std::array<Index3, 4>& vertices, const LeafWeights& weights, Row row) const {
    const Box around = intersection(box_around(vertices), volume_);
    for (std::int64_t z = around.low.z; z <= around.high.z; ++z)
      for (std::int64_t y = around.low.y; y <= around.high.y; ++y) {
        std::array<std::int64_t, 4> at = weights.at({around.low.x, y, z});
        std::int64_t first = 0, last = around.high.x - around.low.x;
        for (std::size_t i = 0; i < 4; ++i) {
          const std::int64_t growth = weights.growth[i].x;
          if (growth > 0) first = std::max(first, growth == 1 ? -at[i] : (1 - at[i]) >> 1);
          if (growth < 0) last = std::min(last, growth == -1 ? at[i] : at[i] >> 1);
          if (growth == 0 && at[i] < 0) last = -1;
        }
        if (first > last) continue;
        for (std::size_t i = 0; i < 4; ++i) at[i] += first * weights.growth[i].x;
        if (row(Index3{around.low.x + first, y, z}, at, last - first + 1)) return true;
      }
    return false;
  }

  bool integers_violate(const std::array<Index3, 4>& vertices, std::int64_t unit,
                        std::int64_t allowed) const {
    using Number = typename IntegerLimit<T>::Number;
    const LeafWeights weights = weights_in(vertices, unit);
    std::array<std::int64_t, 4> values;
    std::int64_t growth = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      values[i] = number(vertices[i]);
      growth += weights.growth[i].x * values[i];
    }
    const auto whole = static_cast<Number>(2 * unit), step = static_cast<Number>(growth);
    return any_row(
        vertices, weights, [&](Index3 p, const std::array<std::int64_t, 4>& at, std::int64_t count) {
          std::int64_t sum = 0;
          for (std::size_t i = 0; i < 4; ++i) sum += at[i] * values[i];
          const T* sample = &samples_.at(p);
          auto here = static_cast<Number>(sum);
          Number worst = 0;
          for (std::int64_t x = 0; x < count; ++x, here += step)
            worst =
                std::max(worst, static_cast<Number>(std::abs(whole * static_cast<Number>(sample[x]) - here)));
          return worst > allowed;
        });
  }

  // The value of the field at a lattice point of the tetrahedron, rounded: halves go up.
  std::int64_t rounded(const std::array<std::int64_t, 4>& weights, const std::array<std::int64_t, 4>& values,
                       std::int64_t unit) const {
    std::int64_t sum = unit;
    for (std::size_t i = 0; i < 4; ++i) sum += weights[i] * values[i];
    const std::int64_t whole = 2 * unit;
    return sum >= 0 ? sum / whole : -((whole - 1 - sum) / whole);
  }

  bool violates_in_pieces(const std::array<Index3, 4>& vertices, std::int64_t unit) const {
    const LeafWeights weights = weights_in(vertices, unit);
    std::array<std::int64_t, 4> values;
    for (std::size_t i = 0; i < 4; ++i) values[i] = number(vertices[i]);
    for (const auto& piece : cut_at(vertices, volume_)) {
      std::array<std::int64_t, 4> corners;
      for (std::size_t i = 0; i < 4; ++i) corners[i] = rounded(weights.at(piece[i]), values, unit);
      const std::int64_t allowed = limit_.times(six_volumes(piece));
      bool violated = false;
      for_each_point_of(piece, volume_, [&](Index3 p, const std::array<std::int64_t, 4>& at) {
        const std::int64_t sample = number(p);
        std::int64_t difference = 0;
        for (std::size_t i = 0; i < 4; ++i) difference += at[i] * (corners[i] - sample);
        violated = violated || std::abs(difference) > allowed;
      });
      if (violated) return true;
    }
    return false;
  }

  // Samples that are not finite violate every bound, unless they are vertices. Interpolations are computed in
  // doubles; what is allowed is reduced by the largest error of their rounding and, where the mesh is cut, by
  // that of values that are rounded to T. If all samples are equal, nothing is rounded.
  bool floats_violate(const std::array<Index3, 4>& vertices, std::int64_t unit, bool cut) const {
    std::array<double, 4> values;
    double most = 0;
    bool finite = true, constant = true;
    for (std::size_t i = 0; i < 4; ++i) {
      const T value = samples_.at(vertices[i]);
      values[i] = static_cast<double>(value);
      finite = finite && std::isfinite(value);
      constant = constant && identical(value, samples_.at(vertices[0]));
      most = std::max(most, std::fabs(values[i]));
    }
    constexpr double of_cut = sizeof(T) == 4 ? 0x1p-23 : 0x1p-46,
                     least_of_cut = sizeof(T) == 4 ? 0x1p-148 : 0x1p-1060;
    const double relative = cut ? of_cut : 0x1p-48, least = cut ? least_of_cut : 0;
    const double whole = 2 * static_cast<double>(unit);
    const double allowed = whole * (bound_.largest - ((most + bound_.largest) * relative + least));
    const LeafWeights weights = weights_in(vertices, unit);
    return any_row(
        vertices, weights, [&](Index3 p, const std::array<std::int64_t, 4>& first, std::int64_t count) {
          const T* sample = &samples_.at(p);
          std::array<std::int64_t, 4> at = first;
          for (std::int64_t x = 0; x < count; ++x) {
            double sum = 0;
            bool vertex = false;
            for (std::size_t i = 0; i < 4; ++i) {
              sum += static_cast<double>(at[i]) * values[i];
              vertex = vertex || at[i] == 2 * unit;
              at[i] += weights.growth[i].x;
            }
            const bool near = finite && std::fabs(whole * static_cast<double>(sample[x]) - sum) <= allowed;
            const bool equal = finite && constant && identical(sample[x], samples_.at(vertices[0]));
            if (!near && !equal && !vertex) return true;
          }
          return false;
        });
  }

  struct NoLimit {
    explicit NoLimit(double) {}
  };

  const Samples<T>& samples_;
  MeshBound bound_;
  Box volume_;
  std::conditional_t<std::is_integral_v<T>, IntegerLimit<T>, NoLimit> limit_;
};

}  // namespace tagrid
