#include "stages/mesh/tetrahedra.h"

namespace tagrid {
namespace {

constexpr Index3 cross(Index3 a, Index3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
constexpr std::int64_t dot(Index3 a, Index3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// How far each vertex lies above the last sample of the volume, per axis.
struct Excess {
  std::array<Index3, 4> of_vertex;
  std::size_t count = 0;
};

// The hull of the vertices has a point that is below zero on all axes, unless some weights w >= 0 of the
// axes, not all zero, make w . e >= 0 for every vertex e (Gordan's theorem). Such weights form a cone with a
// corner at zero, so if there are any then also on an extreme ray, where two of the inequalities are
// equalities.
bool is_separated(const Excess& excess) {
  std::array<Index3, 7> inequalities = {unit_vector(0), unit_vector(1), unit_vector(2)};
  const std::size_t n = 3 + excess.count;
  std::copy_n(excess.of_vertex.begin(), excess.count, inequalities.begin() + 3);
  const auto holds = [&](Index3 w) {
    return std::all_of(inequalities.begin(), inequalities.begin() + static_cast<std::ptrdiff_t>(n),
                       [&](Index3 e) { return dot(w, e) >= 0; });
  };
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Index3 w = cross(inequalities[i], inequalities[j]);
      if (w != Index3{} && (holds(w) || holds(-1 * w))) return true;
    }
  return false;
}

}  // namespace

bool lies_outside_volume(const std::array<Index3, 4>& vertices, Index3 dims) {
  const Index3 last = dims - Index3{1, 1, 1};
  Excess excess;
  for (Index3 v : vertices) {
    bool in_sample_planes = true;
    for (int axis = 0; axis < 3; ++axis) in_sample_planes &= last[axis] > 0 || v[axis] == 0;
    if (in_sample_planes) excess.of_vertex[excess.count++] = v - last;
  }
  if (excess.count == 0) return true;
  int crossed_axes = 0;
  for (int axis = 0; axis < 3; ++axis) {
    bool any_below = last[axis] == 0, any_above = false;
    for (std::size_t i = 0; i < excess.count; ++i) {
      any_below |= excess.of_vertex[i][axis] < 0;
      any_above |= excess.of_vertex[i][axis] > 0;
    }
    if (!any_below) return true;
    if (last[axis] > 0 && any_above) {
      ++crossed_axes;
    } else {
      // This axis separates nothing. A small negative number says so and keeps the products small.
      for (std::size_t i = 0; i < excess.count; ++i) excess.of_vertex[i][axis] = -1;
    }
  }
  return crossed_axes >= 2 && is_separated(excess);
}

}  // namespace tagrid
