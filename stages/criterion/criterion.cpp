#include "stages/criterion/criterion.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "stages/sample/vector_code.h"

namespace tagrid {
namespace {

// 1 - sin(x)/x by its series; the error is below float precision for |x| <= 1.05.
constexpr double sine_deficit(double x2) {
  return x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42 * (1 - x2 / 72 * (1 - x2 / 110 * (1 - x2 / 156)))));
}

// (1 - cos(x)) / x^2 by its series.
TAGRID_INLINE float versine_over_square(float x2) {
  constexpr float c1 = 1.0F / 12, c2 = 1.0F / 30, c3 = 1.0F / 56, c4 = 1.0F / 90, c5 = 1.0F / 132;
  return 0.5F * (1.0F - x2 * c1 * (1.0F - x2 * c2 * (1.0F - x2 * c3 * (1.0F - x2 * c4 * (1.0F - x2 * c5)))));
}

// sin(x)/x by its series; the error is below float precision for |x| <= 2.1.
TAGRID_INLINE float sine_over_angle(float x2) {
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
TAGRID_INLINE float cross(Vector2 a, Vector2 b) { return a.x * b.y - a.y * b.x; }

// The control points one step before and one step after an end, relative to it.
struct EndSteps {
  Vector2 behind, ahead;
};

TAGRID_INLINE EndSteps osculating_steps(float slope, float bend, float longest_step, float step_angle) {
  const float to_unit = 1.0F / std::sqrt(1.0F + slope * slope);
  const float curvature = std::fabs(bend) * (to_unit * to_unit * to_unit);
  const float arc = step_angle / curvature;  // infinite if the curve is straight
  const float step = arc < longest_step ? arc : longest_step;
  const float angle = step * curvature;
  const float along = step * sine_over_angle(angle * angle);
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
  // By coordinates: copies of vectors keep the compiler from vectorizing the loop over the edges.
  polygon.legs[0] = {-l.behind.x, -l.behind.y};
  polygon.legs[1] = {l.ahead.x, l.ahead.y};
  polygon.legs[2] = right + (r.behind - l.ahead);
  polygon.legs[3] = {-r.behind.x, -r.behind.y};
  polygon.legs[4] = {r.ahead.x, r.ahead.y};
  // A spline starts and ends at (1,4,1)/6 of its first and last three control points.
  polygon.chord = right + (1.0F / 6) * ((r.behind + r.ahead) - (l.behind + l.ahead));
  return polygon;
}

// A piece of a segment is the straight line between two of its parameters: a fixed combination of three legs.
struct PieceWeights {
  float w[4][3];
};

constexpr PieceWeights piece_weights() {
  PieceWeights pieces{};
  // Sums of the B-spline weights of the control points after a leg: the share of the leg in the position.
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

// How much longer piece `k` of a segment is than its projection on the chord. |v| - v.c is computed as (v x
// c)^2 / (|v| + v.c), so no digits are lost if the curve is almost straight.
TAGRID_INLINE float piece_excess(Vector2 a, Vector2 b, Vector2 c, Vector2 direction, int k) {
  const Vector2 piece = (pieces.w[k][0] * a + pieces.w[k][1] * b) + pieces.w[k][2] * c;
  const float length = std::sqrt(dot(piece, piece));
  const float along = dot(piece, direction), across = cross(piece, direction);
  const float sum = length + std::fabs(along);
  const float forwards = across * across / sum;
  return along > 0 ? forwards : sum;
}

TAGRID_INLINE float segment_excess(Vector2 a, Vector2 b, Vector2 c, Vector2 direction) {
  return (piece_excess(a, b, c, direction, 0) + piece_excess(a, b, c, direction, 1)) +
         (piece_excess(a, b, c, direction, 2) + piece_excess(a, b, c, direction, 3));
}

// R - C, as the pieces add up to the chord. The sum is unrolled: inner loops would not vectorize.
TAGRID_INLINE float spline_excess(const ControlPolygon& polygon, Vector2 direction) {
  const auto& legs = polygon.legs;
  return (segment_excess(legs[0], legs[1], legs[2], direction) +
          segment_excess(legs[1], legs[2], legs[3], direction)) +
         segment_excess(legs[2], legs[3], legs[4], direction);
}

}  // namespace

CriterionParameters::CriterionParameters(int m, const Multiples& multiples) {
  const double half_turn = std::numbers::pi / m, deficit = sine_deficit(half_turn * half_turn);
  const double of_m = deficit / (1 - deficit);  // 1 / (1 - d) - 1
  for (std::size_t i = 0; i < excesses; ++i) excess[i] = static_cast<float>(multiples[i] * of_m);
  const double over = multiples[0] * of_m;
  step_angle = static_cast<float>(2 * half_turn);
  threshold = static_cast<float>(1 + over);
}

TAGRID_VECTOR_CODE
void measure(const EdgeBatch& edges, std::size_t count, const CriterionParameters& parameters,
             EdgeBatch::Flags& exceeded) {
  const float low = parameters.excess[0], middle = parameters.excess[1], high = parameters.excess[2];
  const float step_angle = parameters.step_angle;
  // Whole vectors: the compiler would measure a rest edge by edge.
  constexpr std::size_t together = 16;
  static_assert(EdgeBatch::capacity % together == 0);
  const std::size_t lanes = (count + together - 1) / together * together;
  for (std::size_t i = 0; i < lanes; ++i) {
    const ControlPolygon polygon =
        control_polygon(edges.rise[i], edges.slope_left[i], edges.bend_left[i], edges.slope_right[i],
                        edges.bend_right[i], edges.length[i], step_angle);
    const float chord = std::sqrt(dot(polygon.chord, polygon.chord));
    const float over = spline_excess(polygon, (1.0F / chord) * polygon.chord);
    const int number = (over > low * chord) + (over > middle * chord) + (over > high * chord);
    exceeded[i] = static_cast<std::uint32_t>(over <= std::numeric_limits<float>::max() ? number : 0);
  }
}

}  // namespace tagrid
