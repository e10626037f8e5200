#include "stages/mesh/cut.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <span>
#include <utility>

namespace tagrid {
namespace {

struct Corner {
  Index3 at;
  unsigned planes = 0;  // bits 0 .. 3: faces of the tetrahedron; 4 .. 9: planes of the border
};

// The order of corners that all triangulations follow.
constexpr bool is_lower(const Corner& a, const Corner& b) {
  if (a.at.z != b.at.z) return a.at.z < b.at.z;
  if (a.at.y != b.at.y) return a.at.y < b.at.y;
  return a.at.x < b.at.x;
}

// Two corners that share two different planes are joined by an edge: the line of the planes meets the
// polytope in one edge, even in degenerate cases.
constexpr bool is_edge(const Corner& a, const Corner& b) { return std::popcount(a.planes & b.planes) >= 2; }

// Insertion sort, as there are at most sixteen.
template <class Item, class Before>
void sort_few(std::span<Item> items, Before before) {
  for (std::size_t i = 1; i < items.size(); ++i)
    for (std::size_t j = i; j > 0 && before(items[j], items[j - 1]); --j) std::swap(items[j], items[j - 1]);
}

class Polytope {
 public:
  explicit Polytope(const std::array<Index3, 4>& vertices) : count_(4) {
    for (std::size_t i = 0; i < 4; ++i) corners_[i] = {vertices[i], 0xfu & ~(1u << i)};
  }

  // Keeps the part on one side of the plane where the coordinate is `border`: below it (side = 1), or above it
  // (side = -1).
  void clip(int axis, int side, std::int64_t border) {
    const std::array<Corner, most> all = corners_;
    const std::span<const Corner> before(all.data(), count_);
    const auto outside = [&](const Corner& c) { return side * (c.at[axis] - border) > 0; };
    const auto inside = [&](const Corner& c) { return side * (c.at[axis] - border) < 0; };
    if (std::none_of(before.begin(), before.end(), outside)) return;
    count_ = 0;
    if (std::none_of(before.begin(), before.end(), inside)) return;
    const unsigned plane = 1u << (side > 0 ? 4 + axis : 7 + axis);
    for (const Corner& a : before) {
      if (inside(a)) add(a);
      if (a.at[axis] == border) add({a.at, a.planes | plane});
      for (const Corner& b : before)
        if (inside(a) && outside(b) && is_edge(a, b))
          add({meeting_point(a.at, b.at, axis, border), (a.planes & b.planes) | plane});
    }
  }

  Pieces triangulate() {
    Pieces pieces;
    if (count_ == 0) return pieces;
    sort_few(std::span(corners_).first(count_), is_lower);
    const Corner& lowest = corners_[0];
    for (unsigned plane = 1; plane < 1u << 10; plane <<= 1) {
      if (lowest.planes & plane) continue;
      std::array<Index3, most> face;
      std::size_t n = 0;
      for (std::size_t i = 1; i < count_; ++i)
        if (corners_[i].planes & plane) face[n++] = corners_[i].at;
      if (n < 3) continue;
      // Sorted around the lowest corner of the face, which is its first.
      const Index3 normal = cross(face[1] - face[0], face[2] - face[0]);
      sort_few(std::span(face).subspan(1, n - 1),
               [&](Index3 a, Index3 b) { return dot(normal, cross(a - face[0], b - face[0])) > 0; });
      for (std::size_t i = 2; i < n; ++i) {
        std::array<Index3, 4> piece = {lowest.at, face[0], face[i - 1], face[i]};
        if (six_volumes(piece) < 0) std::swap(piece[2], piece[3]);
        assert(six_volumes(piece) > 0);
        pieces.vertices[pieces.count++] = piece;
      }
    }
    return pieces;
  }

 private:
  static constexpr std::size_t most = 16;  // corners

  void add(const Corner& c) { corners_[count_++] = c; }

  static Index3 meeting_point(Index3 a, Index3 b, int axis, std::int64_t border) {
    const Index3 d = b - a, way = (border - a[axis]) * d;
    assert(way.x % d[axis] == 0 && way.y % d[axis] == 0 && way.z % d[axis] == 0);
    return a + Index3{way.x / d[axis], way.y / d[axis], way.z / d[axis]};
  }

  std::array<Corner, most> corners_;
  std::size_t count_;
};

bool apart_along(Index3 normal, const std::array<Index3, 4>& vertices, const Box& box) {
  std::int64_t low = dot(normal, vertices[0]), high = low;
  for (const Index3& v : vertices) {
    low = std::min(low, dot(normal, v));
    high = std::max(high, dot(normal, v));
  }
  std::int64_t box_low = 0, box_high = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t a = normal[axis] * box.low[axis], b = normal[axis] * box.high[axis];
    box_low += std::min(a, b);
    box_high += std::max(a, b);
  }
  return box_high < low || high < box_low;
}

}  // namespace

Pieces cut_at(const std::array<Index3, 4>& vertices, const Box& volume) {
  Polytope polytope(vertices);
  for (int axis = 0; axis < 3; ++axis) {
    polytope.clip(axis, 1, volume.high[axis]);
    polytope.clip(axis, -1, volume.low[axis]);
  }
  return polytope.triangulate();
}

bool meets(const std::array<Index3, 4>& given, const Box& given_box) {
  const Box bounds = box_around(given);
  // Only what lies in the tetrahedron's own box matters. Coordinates relative to its corner are small.
  Box box = intersection(bounds, given_box);
  if (box.empty()) return false;
  box = {box.low - bounds.low, box.high - bounds.low};
  std::array<Index3, 4> vertices;
  for (std::size_t i = 0; i < 4; ++i) vertices[i] = given[i] - bounds.low;

  for (std::size_t i = 0; i < 4; ++i) {
    const Index3 a = vertices[(i + 1) % 4], b = vertices[(i + 2) % 4], c = vertices[(i + 3) % 4];
    if (apart_along(cross(b - a, c - a), vertices, box)) return false;
    for (std::size_t j = 0; j < i; ++j)
      for (int axis = 0; axis < 3; ++axis)
        if (apart_along(cross(vertices[i] - vertices[j], unit_vector(axis)), vertices, box)) return false;
  }
  return true;
}

}  // namespace tagrid
