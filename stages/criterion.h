// The accuracy criterion of the paper (its section 3): does the curve of field values along a base edge bend
// too much for a straight line?
//
// In the plane whose x axis runs along the edge and whose y axis is the field value in voxels, the osculating
// circles of the curve at both ends give six control points of a uniform cubic B-spline: on each circle the
// end point itself and one step behind and ahead of it. The step is the arc 2 pi/m, at most a third of the
// distance of the ends. R is the length of the spline, each of its three segments measured by four straight
// pieces, C the distance of the spline's two ends. The edge violates the criterion when
//
//   R / C  >  (pi/m) / sin(pi/m),
//
// the ratio of arc and chord of the regular m-gon in its circle (Eq. 7, Fig. 10 and 25 of the paper).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tagrid {

/// Constants of the criterion for m; the same bits on every machine.
struct CriterionParameters {
  float step_angle;  ///< 2 pi / m, radians
  float threshold;   ///< (pi/m) / sin(pi/m)
  float excess;      ///< threshold - 1, to float precision whatever m: what the criterion compares
  float tangent;     ///< of acos(1 / threshold)

  /// REQUIRES: m >= 3.
  explicit CriterionParameters(int m);
};

/// Up to `capacity` base edges of one class, as the kernel wants them: everything in voxels.
struct EdgeBatch {
  static constexpr std::size_t capacity = 64;

  using Lane = std::array<float, capacity>;
  alignas(64) Lane rise;                     ///< height at the right end minus height at the left end
  alignas(64) Lane slope_left, slope_right;  ///< first derivative along the edge
  alignas(64) Lane bend_left, bend_right;    ///< second derivative along the edge
};

/// Whether all `count` edges are level and straight, as they are in a constant region: none violates.
bool all_flat(const EdgeBatch& edges, std::size_t count);

/// First, quick test of `count` edges of length `length`: clear[i] is 1 where every leg of the control
/// polygon is within acos(1/threshold) of the direction of the chord, so that the edge cannot violate the
/// criterion.
void rule_out(const EdgeBatch& edges, std::size_t count, float length, const CriterionParameters& parameters,
              std::array<std::uint8_t, EdgeBatch::capacity>& clear);

/// The criterion itself: violated[i] is 1 where edge i, of length lengths[i], violates it. Non-finite input
/// violates nothing.
void measure(const EdgeBatch& edges, const EdgeBatch::Lane& lengths, std::size_t count,
             const CriterionParameters& parameters, std::array<std::uint8_t, EdgeBatch::capacity>& violated);

}  // namespace tagrid
