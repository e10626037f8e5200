#include "stages/criterion.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "stages/vector_code.h"

namespace tagrid {
namespace {

#define TAGRID_INLINE inline __attribute__((always_inline))

// sin(x)/x by its series; for |x| <= 2.1 the error is below float precision.
template <class Real>
TAGRID_INLINE Real sine_over_angle(Real x2) {
  return Real(1) -
         x2 / Real(6) *
             (Real(1) -
              x2 / Real(20) *
                  (Real(1) -
                   x2 / Real(42) *
                       (Real(1) - x2 / Real(72) * (Real(1) - x2 / Real(110) * (Real(1) - x2 / Real(156))))));
}

// (1 - cos(x)) / x^2 by its series.
TAGRID_INLINE float versine_over_square(float x2) {
  constexpr float c1 = 1.0F / 12, c2 = 1.0F / 30, c3 = 1.0F / 56, c4 = 1.0F / 90, c5 = 1.0F / 132;
  return 0.5F * (1.0F - x2 * c1 * (1.0F - x2 * c2 * (1.0F - x2 * c3 * (1.0F - x2 * c4 * (1.0F - x2 * c5)))));
}

TAGRID_INLINE float sine_over_angle_float(float x2) {
  constexpr float c1 = 1.0F / 6, c2 = 1.0F / 20, c3 = 1.0F / 42, c4 = 1.0F / 72, c5 = 1.0F / 110,
                  c6 = 1.0F / 156;
  return 1.0F -
         x2 * c1 *
             (1.0F - x2 * c2 * (1.0F - x2 * c3 * (1.0F - x2 * c4 * (1.0F - x2 * c5 * (1.0F - x2 * c6)))));
}

struct Vector2 {
  float x, y;
};

TAGRID_INLINE Vector2 operator+(Vector2 a, Vector2 b) { return {a.x + b.x, a.y + b.y}; }
TAGRID_INLINE Vector2 operator-(Vector2 a, Vector2 b) { return {a.x - b.x, a.y - b.y}; }
TAGRID_INLINE Vector2 operator*(float s, Vector2 a) { return {s * a.x, s * a.y}; }
TAGRID_INLINE float dot(Vector2 a, Vector2 b) { return a.x * b.x + a.y * b.y; }

// The control points one step behind and ahead of an end, relative to it.
struct EndSteps {
  Vector2 behind, ahead;
};

TAGRID_INLINE EndSteps osculating_steps(float slope, float bend, float longest_step, float step_angle) {
  const float to_unit = 1.0F / std::sqrt(1.0F + slope * slope);
  const float curvature = std::fabs(bend) * (to_unit * to_unit * to_unit);
  const float arc = step_angle / curvature;  // infinite where the curve is straight
  const float step = arc < longest_step ? arc : longest_step;
  const float angle = step * curvature;
  const float along = step * sine_over_angle_float(angle * angle);
  const float inwards = step * angle * versine_over_square(angle * angle);
  const float across = bend < 0 ? -inwards : inwards;
  const Vector2 tangent{to_unit, slope * to_unit};
  const Vector2 towards_centre{-across * tangent.y, across * tangent.x};
  return {towards_centre - along * tangent, towards_centre + along * tangent};
}

// The five legs of the control polygon and the chord of its spline.
struct ControlPolygon {
  Vector2 legs[5];
  Vector2 chord;
};

TAGRID_INLINE ControlPolygon control_polygon(float rise, float slope_left, float bend_left, float slope_right,
                                             float bend_right, float length, float step_angle) {
  const Vector2 right{length, rise};
  const float third = std::sqrt(dot(right, right)) * (1.0F / 3);
  const EndSteps l = osculating_steps(slope_left, bend_left, third, step_angle);
  const EndSteps r = osculating_steps(slope_right, bend_right, third, step_angle);
  ControlPolygon polygon;
  polygon.legs[0] = {-l.behind.x, -l.behind.y};
  polygon.legs[1] = l.ahead;
  polygon.legs[2] = right + (r.behind - l.ahead);
  polygon.legs[3] = {-r.behind.x, -r.behind.y};
  polygon.legs[4] = r.ahead;
  // A spline starts and ends at (1,4,1)/6 of its first and last three control points.
  polygon.chord = right + (1.0F / 6) * ((r.behind + r.ahead) - (l.behind + l.ahead));
  return polygon;
}

// A piece of a segment is the straight line between two parameters of it: a fixed combination of three legs.
struct PieceWeights {
  float w[4][3];
};

constexpr PieceWeights piece_weights() {
  PieceWeights pieces{};
  // Sums of the B-spline weights of the control points after a leg: what the leg adds to the position.
  auto leg_weights = [](double t, double(&w)[3]) {
    const double b0 = (1 - t) * (1 - t) * (1 - t) / 6;
    const double b3 = t * t * t / 6;
    const double b2 = (1 + 3 * t + 3 * t * t - 3 * t * t * t) / 6;
    w[0] = 1 - b0;
    w[1] = b2 + b3;
    w[2] = b3;
  };
  for (int k = 0; k < 4; ++k) {
    double from[3] = {}, to[3] = {};
    leg_weights(k / 4.0, from);
    leg_weights((k + 1) / 4.0, to);
    for (int j = 0; j < 3; ++j) pieces.w[k][j] = static_cast<float>(to[j] - from[j]);
  }
  return pieces;
}

constexpr PieceWeights pieces = piece_weights();

TAGRID_INLINE float spline_length(const ControlPolygon& polygon) {
  float sum = 0;
  for (int segment = 0; segment < 3; ++segment)
    for (int k = 0; k < 4; ++k) {
      const Vector2 piece =
          (pieces.w[k][0] * polygon.legs[segment] + pieces.w[k][1] * polygon.legs[segment + 1]) +
          pieces.w[k][2] * polygon.legs[segment + 2];
      sum += std::sqrt(dot(piece, piece));
    }
  return sum;
}

}  // namespace

CriterionParameters::CriterionParameters(int m) {
  const double angle = std::numbers::pi / m;
  step_angle = static_cast<float>(2 * angle);
  threshold = static_cast<float>(1.0 / sine_over_angle(angle * angle));
}

TAGRID_VECTOR_CODE
void rule_out(const EdgeBatch& edges, std::size_t count, float length, const CriterionParameters& parameters,
              std::array<std::uint8_t, EdgeBatch::capacity>& clear) {
  const float square = parameters.threshold * parameters.threshold;
  const float step_angle = parameters.step_angle;
  for (std::size_t i = 0; i < count; ++i) {
    const ControlPolygon polygon =
        control_polygon(edges.rise[i], edges.slope_left[i], edges.bend_left[i], edges.slope_right[i],
                        edges.bend_right[i], length, step_angle);
    const float chord2 = dot(polygon.chord, polygon.chord);
    // Each leg as a margin that is negative where the leg turns too far: a minimum vectorizes, a branch does
    // not.
    const auto margin = [&](Vector2 leg) __attribute__((always_inline)) {
      const float along = dot(leg, polygon.chord);
      const float inside = along * along * square - dot(leg, leg) * chord2;
      return along < inside ? along : inside;
    };
    const auto lower = [](float a, float b) __attribute__((always_inline)) { return a < b ? a : b; };
    const float worst = lower(lower(lower(margin(polygon.legs[0]), margin(polygon.legs[1])),
                                    lower(margin(polygon.legs[2]), margin(polygon.legs[3]))),
                              margin(polygon.legs[4]));
    clear[i] = static_cast<std::uint8_t>(worst >= 0);
  }
}

TAGRID_VECTOR_CODE
void measure(const EdgeBatch& edges, const EdgeBatch::Lane& lengths, std::size_t count,
             const CriterionParameters& parameters, std::array<std::uint8_t, EdgeBatch::capacity>& violated) {
  const float threshold = parameters.threshold, step_angle = parameters.step_angle;
  for (std::size_t i = 0; i < count; ++i) {
    const ControlPolygon polygon =
        control_polygon(edges.rise[i], edges.slope_left[i], edges.bend_left[i], edges.slope_right[i],
                        edges.bend_right[i], lengths[i], step_angle);
    const float chord = std::sqrt(dot(polygon.chord, polygon.chord));
    const float length = spline_length(polygon);
    const float limit = threshold * chord;
    violated[i] = static_cast<std::uint8_t>(length > limit && length <= std::numeric_limits<float>::max());
  }
}

}  // namespace tagrid
