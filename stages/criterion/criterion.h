// The accuracy criterion of the paper (its section 3): does the curve of field values along a base edge bend
// too much for a straight line?
//
// In the plane whose x axis runs along the edge and whose y axis is the field value in voxels, the osculating
// circles of the curve at both ends give six control points of a uniform cubic B-spline: on each circle the
// end point itself, and one point a step behind and one a step ahead of it. The step is the arc 2 pi/m, but
// at most a third of the distance between the ends. R is the length of the spline, whose three segments are
// each measured by four straight pieces. C is the distance between the spline's two ends. The edge violates
// the criterion if
//
//   R / C  >  (pi/m) / sin(pi/m),
//
// which is the ratio of arc and chord of the regular m-gon in its circle (Eq. 7, Figs. 10 and 25 of the
// paper).
//
// The forecast of the activity is computed by measure(), which is therefore part of the format (section 6.6
// of docs/dev/format.md): no operation may be reordered.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace tagrid {

/// Constants of the criterion for m; the same bits on every machine.
struct CriterionParameters {
  static constexpr std::size_t excesses = 3;
  using Multiples = std::array<double, excesses>;

  float step_angle;  ///< 2 pi / m, radians
  float threshold;   ///< (pi/m) / sin(pi/m)
  /// Multiples of threshold - 1, to float precision for every m: what the criterion compares.
  std::array<float, excesses> excess;

  /// `multiples` of the criterion's own excess, ascending. `threshold` is that of the first one.
  /// REQUIRES: m >= 3.
  explicit CriterionParameters(int m, const Multiples& multiples = just_one);

 private:
  static constexpr Multiples just_one = {1, std::numeric_limits<double>::infinity(),
                                         std::numeric_limits<double>::infinity()};
};

/// Up to `capacity` base edges, as input of the kernel. All lengths are in voxels.
struct EdgeBatch {
  static constexpr std::size_t capacity = 256;
  static constexpr std::size_t padding =
      16;  ///< entries that may be written beyond, as an entire vector is written

  using Lane = std::array<float, capacity + padding>;
  using Flags = std::array<std::uint32_t, capacity>;  ///< a small number for each edge
  alignas(64) Lane rise;                     ///< height at the right end minus height at the left end
  alignas(64) Lane slope_left, slope_right;  ///< first derivative along the edge
  alignas(64) Lane bend_left, bend_right;    ///< second derivative along the edge
  alignas(64) Lane length;                   ///< distance of the ends in space
};

/// exceeded[i] is the number of excesses that edge i of the first `count` edges exceeds; numbers after them
/// mean nothing. Edges with values that are not finite exceed none. REQUIRES: all edges are initialized.
void measure(const EdgeBatch& edges, std::size_t count, const CriterionParameters& parameters,
             EdgeBatch::Flags& exceeded);

}  // namespace tagrid
