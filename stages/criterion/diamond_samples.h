// The samples of the volume in one diamond, each with its interpolation at the vertices of its tetrahedron.
// The mesh criterion compares the two.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <utility>
#include <vector>

#include "stages/grid/brick_grid.h"
#include "stages/grid/lattice.h"
#include "stages/sample/numbers.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// Samples of integers: errors are exact.
template <class T>
class IntegerErrors {
 public:
  using Number = std::int64_t;
  IntegerErrors(const T* here, std::int64_t unit, Number enough)
      : here_(here), unit_(unit), enough_(enough) {}

  Number value(std::int64_t offset) const { return here_[offset]; }
  /// Compares 2u times the sample at `offset` with the weighted sum. Returns true if the error is large
  /// enough to stop.
  bool see(std::int64_t offset, Number sum) {
    worst_ = std::max(worst_, std::abs(2 * unit_ * value(offset) - sum));
    return worst_ > enough_;
  }
  Number worst() const { return worst_; }

 private:
  const T* here_;
  std::int64_t unit_;
  Number enough_, worst_ = 0;
};

/// Samples of floats. A vertex has no error. Samples that are not finite, or too large to be interpolated
/// without an overflow, have an infinite error.
template <class T>
class FloatErrors {
 public:
  using Number = double;
  FloatErrors(const T* here, std::int64_t unit, Number bound, Number value_error,
              const std::vector<std::int64_t>& vertices)
      : here_(here), unit_(static_cast<double>(unit)), vertices_(vertices) {
    double largest = 0;
    for (const std::int64_t v : vertices) {
      finite_ = finite_ && std::isfinite(here[v]);
      constant_ = constant_ && identical(here[v], here[vertices[0]]);
      largest = std::max(largest, std::fabs(static_cast<double>(here[v])));
    }
    // Decoded vertices have errors of up to `value_error`. Each of at most 24 means is rounded, and so is the
    // result; at a cut, it is the weighted sum of a piece that is rounded.
    constexpr double relative = sizeof(T) == 4 ? 0x1p-23 : 0x1p-46;
    constexpr double least = sizeof(T) == 4 ? 0x1p-148 : 0x1p-1060;
    enough_ = 2 * unit_ * (bound - ((largest + std::max(bound, value_error)) * relative + least));
  }

  Number value(std::int64_t offset) const { return static_cast<double>(here_[offset]); }
  bool see(std::int64_t offset, Number sum) {
    if (finite_ && constant_ && identical(here_[offset], here_[vertices_[0]])) return false;
    const double error = std::fabs(2 * unit_ * value(offset) - sum);
    if (finite_ && error <= enough_) return false;
    violated_ = violated_ || std::find(vertices_.begin(), vertices_.end(), offset) == vertices_.end();
    return violated_;
  }
  bool violated() const { return violated_; }

 private:
  const T* here_;
  double unit_, enough_;
  const std::vector<std::int64_t>& vertices_;
  bool finite_ = true, constant_ = true, violated_ = false;
};

/// Passes every sample of the volume in one diamond to `errors`, with its interpolation times 2u. In each
/// formula, the weights of the four vertices of a tetrahedron are integers that sum to 2u.
template <class T, class Errors>
class DiamondSamples {
 public:
  using Number = typename Errors::Number;

  DiamondSamples(const Samples<T>& samples, const Domain& domain, Index3 p, const PointClass& c,
                 Errors& errors)
      : samples_(samples),
        volume_(domain.volume()),
        p_(p),
        u_(c.unit),
        class_(c),
        edge_(base_edge(p, c, domain.cube_size)),
        errors_(errors) {
    const Index3 size = samples.box.size();
    stride_[0] = 1;
    stride_[1] = size.x;
    stride_[2] = size.x * size.y;
  }

  void show() {
    if (class_.odd == 3) in_cube();
    if (class_.odd == 2) in_octahedron();
    if (class_.odd == 1) around_edge();
  }

 private:
  // Offset from the point in units of samples.
  Number value(std::int64_t offset) const { return errors_.value(offset); }
  bool see(std::int64_t offset, Number sum) { return errors_.see(offset, sum); }
  // A weight, in the type that multiplies values.
  static Number of(std::int64_t weight) { return static_cast<Number>(weight); }

  // Signs of the base edge along the axes: +1 if it runs from low to high.
  std::int64_t sign(int axis) const { return edge_.right[axis] > edge_.left[axis] ? 1 : -1; }
  // Range of offsets from p along an axis, limited to the volume.
  std::int64_t lowest(int axis, std::int64_t reach) const {
    return std::max(-reach, volume_.low[axis] - p_[axis]);
  }
  std::int64_t highest(int axis, std::int64_t reach) const {
    return std::min(reach, volume_.high[axis] - p_[axis]);
  }

  // Six tetrahedra around the diagonal of a cell: the order of the coordinates along it selects one.
  void in_cube() {
    std::int64_t step[3];  // step of one sample along an axis, in the direction of the diagonal
    for (int axis = 0; axis < 3; ++axis) step[axis] = sign(axis) * stride_[axis];
    const std::int64_t left = -u_ * (step[0] + step[1] + step[2]);
    const Number v0 = value(left), v3 = value(-left);
    for (std::int64_t z = lowest(2, u_); z <= highest(2, u_); ++z)
      for (std::int64_t y = lowest(1, u_); y <= highest(1, u_); ++y)
        for (std::int64_t x = lowest(0, u_); x <= highest(0, u_); ++x) {
          // Coordinates from the left end of the diagonal, 0 .. 2u, in decreasing order.
          std::int64_t a = u_ + sign(0) * x, b = u_ + sign(1) * y, c = u_ + sign(2) * z;
          std::int64_t sa = step[0], sb = step[1], sc = step[2];
          if (a < b) std::swap(a, b), std::swap(sa, sb);
          if (b < c) std::swap(b, c), std::swap(sb, sc);
          if (a < b) std::swap(a, b), std::swap(sa, sb);
          const Number v1 = value(left + 2 * u_ * sa), v2 = value(left + 2 * u_ * (sa + sb));
          if (see(x + y * stride_[1] + z * stride_[2],
                  v0 * of(2 * u_ - a) + v1 * of(a - b) + v2 * of(b - c) + v3 * of(c)))
            return;
        }
  }

  // Two tetrahedra on either side of a face, each over one half of it, with the cube centre as its apex.
  void in_octahedron() {
    const int normal = !class_.is_odd[0] ? 0 : !class_.is_odd[1] ? 1 : 2;
    const int i = normal == 0 ? 1 : 0, j = normal == 2 ? 1 : 2;
    const std::int64_t si = sign(i) * stride_[i], sj = sign(j) * stride_[j];
    const std::int64_t left = -u_ * (si + sj);
    const Number v_left = value(left), v_right = value(-left), v_i = value(left + 2 * u_ * si),
                 v_j = value(left + 2 * u_ * sj);
    for (std::int64_t h = lowest(normal, u_); h <= highest(normal, u_); ++h) {
      const std::int64_t height = std::abs(h), reach = u_ - height;
      const Number apex = h == 0 ? 0 : value((h > 0 ? u_ : -u_) * stride_[normal]);
      for (std::int64_t s = lowest(i, reach); s <= highest(i, reach); ++s)
        for (std::int64_t t = lowest(j, reach); t <= highest(j, reach); ++t) {
          const std::int64_t a = reach + sign(i) * s, b = reach + sign(j) * t;
          const Number middle = a > b ? v_i * of(a - b) : v_j * of(b - a);
          const Number sum = of(2 * height) * apex + v_left * of(2 * reach - std::max(a, b)) + middle +
                             v_right * of(std::min(a, b));
          if (see(h * stride_[normal] + s * stride_[i] + t * stride_[j], sum)) return;
        }
    }
  }

  // Eight tetrahedra around an axis-parallel edge, each with a face centre and a cube centre beside it.
  void around_edge() {
    const int along = class_.is_odd[0] ? 0 : class_.is_odd[1] ? 1 : 2;
    const int i = along == 0 ? 1 : 0, j = along == 2 ? 1 : 2;
    const Number v_left = value(-u_ * stride_[along]), v_right = value(u_ * stride_[along]);
    for (std::int64_t s = lowest(i, u_); s <= highest(i, u_); ++s)
      for (std::int64_t t = lowest(j, u_); t <= highest(j, u_); ++t) {
        const std::int64_t as = std::abs(s), at = std::abs(t), big = std::max(as, at),
                           small = std::min(as, at);
        const std::int64_t side_i = s < 0 ? -u_ * stride_[i] : u_ * stride_[i],
                           side_j = t < 0 ? -u_ * stride_[j] : u_ * stride_[j];
        const Number v_cube = small > 0 ? value(side_i + side_j) : 0;
        const Number v_face = big > small ? value(as > at ? side_i : side_j) : 0;
        const Number ring = of(2 * small) * v_cube + of(2 * (big - small)) * v_face;
        const std::int64_t reach = u_ - big;
        for (std::int64_t a = lowest(along, reach); a <= highest(along, reach); ++a)
          if (see(a * stride_[along] + s * stride_[i] + t * stride_[j],
                  ring + v_left * of(reach - a) + v_right * of(reach + a)))
            return;
      }
  }

  const Samples<T>& samples_;
  Box volume_;
  Index3 p_;
  std::int64_t u_;
  PointClass class_;
  BaseEdge edge_;
  Errors& errors_;
  std::int64_t stride_[3];
};

}  // namespace tagrid
