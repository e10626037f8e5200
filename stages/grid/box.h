// Points and boxes of the sample lattice. Voxels are points; x is the fastest axis everywhere.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstdint>

namespace tagrid {

/// A point of the lattice, or a vector between two of them.
struct Index3 {
  std::int64_t x = 0, y = 0, z = 0;

  constexpr std::int64_t& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  constexpr std::int64_t operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  friend constexpr bool operator==(const Index3&, const Index3&) = default;
  friend constexpr Index3 operator+(Index3 a, Index3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Index3 operator-(Index3 a, Index3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Index3 operator*(std::int64_t s, Index3 a) { return {s * a.x, s * a.y, s * a.z}; }
};

constexpr Index3 cross(Index3 a, Index3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
constexpr std::int64_t dot(Index3 a, Index3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Unit vector along an axis (0 = x, 1 = y, 2 = z).
constexpr Index3 unit_vector(int axis) { return {axis == 0, axis == 1, axis == 2}; }

/// The lattice points from `low` to `high`, both included. Empty if high < low on any axis.
struct Box {
  Index3 low, high;

  static constexpr Box of_size(Index3 dims) { return {{0, 0, 0}, dims - Index3{1, 1, 1}}; }

  constexpr Index3 size() const { return high - low + Index3{1, 1, 1}; }
  constexpr bool empty() const { return high.x < low.x || high.y < low.y || high.z < low.z; }
  /// Number of points. REQUIRES: it fits into 64 bits.
  constexpr std::int64_t count() const { return empty() ? 0 : size().x * size().y * size().z; }
  constexpr bool contains(Index3 p) const {
    return p.x >= low.x && p.x <= high.x && p.y >= low.y && p.y <= high.y && p.z >= low.z && p.z <= high.z;
  }
  constexpr bool contains(const Box& b) const { return b.empty() || (contains(b.low) && contains(b.high)); }
  /// Raster position of `p`, x fastest. REQUIRES: contains(p).
  constexpr std::int64_t offset(Index3 p) const {
    assert(contains(p));
    return ((p.z - low.z) * size().y + (p.y - low.y)) * size().x + (p.x - low.x);
  }
  /// How far offset() grows along each axis.
  constexpr Index3 strides() const { return {1, size().x, size().x * size().y}; }
  /// The same box with `n` more points on every side.
  constexpr Box grown(std::int64_t n) const { return {low - Index3{n, n, n}, high + Index3{n, n, n}}; }
  constexpr Box moved(Index3 by) const { return {low + by, high + by}; }
  /// The point of the box nearest to `p`. REQUIRES: !empty().
  constexpr Index3 nearest(Index3 p) const {
    return {std::clamp(p.x, low.x, high.x), std::clamp(p.y, low.y, high.y), std::clamp(p.z, low.z, high.z)};
  }
  friend constexpr bool operator==(const Box&, const Box&) = default;
};

constexpr Box intersection(const Box& a, const Box& b) {
  return {{std::max(a.low.x, b.low.x), std::max(a.low.y, b.low.y), std::max(a.low.z, b.low.z)},
          {std::min(a.high.x, b.high.x), std::min(a.high.y, b.high.y), std::min(a.high.z, b.high.z)}};
}

/// Calls visit(Index3) for the points of a box, x fastest, that are a multiple of `step` from the lowest one
/// along each axis.
template <class Visit>
void for_each_point_of(const Box& box, std::int64_t step, Visit visit) {
  for (std::int64_t z = box.low.z; z <= box.high.z; z += step)
    for (std::int64_t y = box.low.y; y <= box.high.y; y += step)
      for (std::int64_t x = box.low.x; x <= box.high.x; x += step) visit(Index3{x, y, z});
}
/// For all of them.
template <class Visit>
void for_each_point_of(const Box& box, Visit visit) {
  for_each_point_of(box, 1, visit);
}

}  // namespace tagrid
