// The oracle of the encoder: the whole volume in memory, one point after the other, in double precision, as
// literally as in the paper and without regard for time. The only code that it shares with the stages is the
// laws of the lattice, which have their own tests.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "stages/grid/brick_grid.h"
#include "stages/grid/lattice.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/samples.h"
#include "tests/support/points.h"

namespace tagrid::oracle {

template <class T>
struct Volume {
  Index3 dims;
  std::vector<T> samples;
  int lead = 0;

  Domain domain(int cube_size) const { return {dims, cube_size, lead}; }
  /// The samples, as points of the lattice.
  Box box() const { return domain(4).volume(); }
  /// The sample at the lattice point `p`, or the nearest one.
  T at(Index3 p) const { return samples[static_cast<std::size_t>(box().offset(box().nearest(p)))]; }
  /// The samples of any box, repeated outside the volume.
  std::vector<T> cut(const Box& box) const {
    std::vector<T> out;
    out.reserve(static_cast<std::size_t>(box.count()));
    for (const auto [x, y, z] : points_of(box)) out.push_back(at({x, y, z}));
    return out;
  }
};

/// A volume from a function of the coordinates.
template <class T, class F>
Volume<T> volume_of(Index3 dims, F f) {
  Volume<T> v{dims, {}};
  v.samples.reserve(static_cast<std::size_t>(Box::of_size(dims).count()));
  for (const auto [x, y, z] : points_of(dims))
    v.samples.push_back(static_cast<T>(
        std::llround(f(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)))));
  return v;
}

/// Value, gradient and Hessian of the B-spline whose coefficients are the samples.
struct Jet {
  double value = 0;
  std::array<double, 3> gradient{};
  std::array<std::array<double, 3>, 3> hessian{};
};

template <class T>
Jet jet(const Volume<T>& v, Index3 p) {
  static constexpr double weights[3][3] = {
      {1.0 / 6, 4.0 / 6, 1.0 / 6}, {-0.5, 0, 0.5}, {1, -2, 1}};  // derivative 0, 1, 2
  const auto sum = [&](std::array<int, 3> derivative) {
    double total = 0;
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
          total += weights[derivative[0]][x + 1] * weights[derivative[1]][y + 1] *
                   weights[derivative[2]][z + 1] * static_cast<double>(v.at(p + Index3{x, y, z}));
    return total;
  };
  Jet j;
  j.value = sum({0, 0, 0});
  for (std::size_t a = 0; a < 3; ++a) {
    std::array<int, 3> d{};
    d[a] = 1;
    j.gradient[a] = sum(d);
    for (std::size_t b = 0; b < 3; ++b) {
      std::array<int, 3> dd{};
      ++dd[a];
      ++dd[b];
      j.hessian[a][b] = sum(dd);
    }
  }
  return j;
}

/// The curve of field values along an edge, at its ends, in voxels.
struct Edge {
  double length = 0, rise = 0;
  double slope_left = 0, bend_left = 0, slope_right = 0, bend_right = 0;
};

/// (pi/m) / sin(pi/m).
inline double threshold(int m) { return (std::numbers::pi / m) / std::sin(std::numbers::pi / m); }

/// R / C of the spline through the six control points of Fig. 25.
inline double arc_over_chord(const Edge& e, int m) {
  struct Point {
    double x, y;
  };
  const double apart = std::hypot(e.length, e.rise);
  // The point of the osculating circle at `end` that is a step of arc away, forwards or backwards.
  const auto on_circle = [&](Point end, double p, double q, double direction) -> Point {
    const double unit = std::sqrt(1 + p * p), curvature = q / (unit * unit * unit);
    const double step =
        curvature == 0 ? apart / 3 : std::min(2 * std::numbers::pi / m / std::abs(curvature), apart / 3);
    const Point tangent{1 / unit, p / unit}, normal{-p / unit, 1 / unit};
    if (curvature == 0) return {end.x + direction * step * tangent.x, end.y + direction * step * tangent.y};
    const double radius = 1 / curvature, angle = direction * step * curvature;
    const double along = radius * std::sin(angle), across = 2 * radius * std::pow(std::sin(angle / 2), 2);
    return {end.x + along * tangent.x + across * normal.x, end.y + along * tangent.y + across * normal.y};
  };
  const Point l{0, 0}, r{e.length, e.rise};
  const std::array<Point, 6> control = {
      on_circle(l, e.slope_left, e.bend_left, -1),   l, on_circle(l, e.slope_left, e.bend_left, 1),
      on_circle(r, e.slope_right, e.bend_right, -1), r, on_circle(r, e.slope_right, e.bend_right, 1)};
  const auto on_spline = [&](std::size_t segment, double t) {
    const double b[4] = {(1 - t) * (1 - t) * (1 - t) / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                         (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6, t * t * t / 6};
    Point s{0, 0};
    for (std::size_t i = 0; i < 4; ++i) {
      s.x += b[i] * control[segment + i].x;
      s.y += b[i] * control[segment + i].y;
    }
    return s;
  };
  const auto distance = [](Point a, Point b) { return std::hypot(b.x - a.x, b.y - a.y); };
  double arc = 0;
  for (std::size_t segment = 0; segment < 3; ++segment)
    for (int k = 0; k < 4; ++k)
      arc += distance(on_spline(segment, k / 4.0), on_spline(segment, (k + 1) / 4.0));
  return arc / distance(on_spline(0, 0), on_spline(2, 1));
}

/// The base edge that ends at two lattice points.
template <class T>
Edge edge_between(const Volume<T>& v, Index3 left, Index3 right, double field_scale) {
  const Index3 d = right - left;
  Edge e;
  e.length = std::sqrt(static_cast<double>(d.x * d.x + d.y * d.y + d.z * d.z));
  const auto along = [&](const Jet& j, double& slope, double& bend) {
    for (int a = 0; a < 3; ++a) {
      const auto ia = static_cast<std::size_t>(a);
      const double ea = static_cast<double>(d[a]) / e.length;
      slope += field_scale * j.gradient[ia] * ea;
      for (int b = 0; b < 3; ++b)
        bend += field_scale * j.hessian[ia][static_cast<std::size_t>(b)] * ea *
                (static_cast<double>(d[b]) / e.length);
    }
  };
  const Jet l = jet(v, left), r = jet(v, right);
  e.rise = field_scale * (r.value - l.value);
  along(l, e.slope_left, e.bend_left);
  along(r, e.slope_right, e.bend_right);
  return e;
}

/// R / C of the base edge of a point.
template <class T>
double arc_over_chord_at(const Volume<T>& v, Index3 p, int cube_size, double field_scale, int m) {
  const BaseEdge e = base_edge(p, classify(p, cube_size), cube_size);
  return arc_over_chord(edge_between(v, e.left, e.right, field_scale), m);
}

/// The closure, one point at a time: every active point makes its parents in `bits.box()` active.
inline void close_under_parents(LatticeBits& bits, int cube_size) {
  std::vector<Index3> asking;
  const Box& box = bits.box();
  for (const auto [x, y, z] : points_of(box)) {
    const Index3 p{x, y, z};
    if (x % cube_size == 0 && y % cube_size == 0 && z % cube_size == 0) bits.set(p);
    if (bits.test(p)) asking.push_back(p);
  }
  while (!asking.empty()) {
    const Index3 p = asking.back();
    asking.pop_back();
    for (Index3 parent : parents(p, classify(p, cube_size), cube_size))
      if (box.contains(parent) && !bits.test(parent)) {
        bits.set(parent);
        asking.push_back(parent);
      }
  }
}

}  // namespace tagrid::oracle
