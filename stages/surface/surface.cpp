#include "stages/surface/surface.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "stages/surface/cases.h"
#include "stages/surface/crossings.h"
#include "stages/surface/edge_numbers.h"

namespace tagrid {
namespace {

bool is_in_border(const std::array<Index3, 3>& face, const Box& volume) {
  for (int axis = 0; axis < 3; ++axis)
    for (const std::int64_t plane : {volume.low[axis], volume.high[axis]})
      if (face[0][axis] == plane && face[1][axis] == plane && face[2][axis] == plane) return true;
  return false;
}

// Calls visit(corners, inside) for the faces in the border of the volume. `corners`: numbers of vertices of
// the tetrahedron; `inside`: a bit for each of the three.
template <class T, class Visit>
void for_each_border_face(const CrossedTetrahedron& t, const Crossings<T>& crossings, const Box& volume,
                          Visit visit) {
  if (!t.at_border) return;
  for (const auto& corners : faces_of_tetrahedron) {
    std::array<Index3, 3> face;
    for (std::size_t i = 0; i < 3; ++i) face[i] = crossings.place(t.vertices[corners[i]]);
    if (!is_in_border(face, volume)) continue;
    unsigned inside = 0;
    for (unsigned i = 0; i < 3; ++i) inside |= ((t.inside >> corners[i]) & 1) << i;
    visit(corners, inside);
  }
}

// Calls visit() with the three corners of each triangle, as edges of the tetrahedron.
template <class T, class Visit>
void for_each_triangle(const CrossedTetrahedron& t, const Crossings<T>& crossings, const SurfaceGrid& grid,
                       Visit visit) {
  for (const auto& triangle : triangles_in_tetrahedron[t.inside]) visit(triangle);
  if (!grid.close) return;
  for_each_border_face(t, crossings, grid.volume, [&](const auto& corners, unsigned inside) {
    for (std::array<CutEdge, 3> triangle : triangles_in_face[inside]) {
      for (CutEdge& corner : triangle) corner = {corners[corner.a], corners[corner.b]};
      visit(triangle);
    }
  });
}

template <class T>
std::int64_t border_edges_of(const CrossedTetrahedron& t, const Crossings<T>& crossings,
                             const SurfaceGrid& grid) {
  std::int64_t count = 0;
  if (!grid.close)
    for_each_border_face(t, crossings, grid.volume,
                         [&](const auto&, unsigned inside) { count += inside != 0 && inside != 7; });
  return count;
}

// The place of the level between the values a and b, one of which is inside: 0 at a, 1 at b.
double crossing(double a, double b, double level) {
  if (!std::isfinite(a) || !std::isfinite(b)) {
    if (std::isinf(a) && std::isinf(b)) return 0.5;
    return std::isfinite(a) ? 0 : 1;
  }
  double rise = b - a;
  if (!std::isfinite(rise)) {
    a /= 2, b /= 2, level /= 2;
    rise = b - a;
  }
  // A damaged grid may have both ends on one side.
  return std::clamp((level - a) / rise, 0.0, 1.0);
}

// On an edge of the tetrahedron.
template <class T>
SurfaceVertex vertex_on(CutEdge edge, const CrossedTetrahedron& t, const Crossings<T>& crossings,
                        double level) {
  if (t.vertices[edge.b] < t.vertices[edge.a]) std::swap(edge.a, edge.b);
  const BrickPoint a = t.vertices[edge.a], b = t.vertices[edge.b];
  const std::uint32_t low = number_of(a), high = number_of(b);
  if (low == high) return {low, low, 0};
  const double first = crossings.value(a), second = crossings.value(b);
  // Both ends may have the level, if one of them is outside because it is alone.
  if (first == second) return {low, high, (t.inside >> edge.b & 1) != 0 ? 1.0 : 0.0};
  return {low, high, crossing(first, second, level)};
}

// Calls visit() for the tetrahedra that are crossed, twice in the same order. They are found once, if they
// are few enough to be remembered: finding them takes as long as making the surface.
template <class T>
class TwiceCrossed {
 public:
  static constexpr std::size_t most = std::size_t{1} << 16;

  explicit TwiceCrossed(Crossings<T>& crossings) : crossings_(crossings) {}

  template <class Visit>
  void first(Visit visit) {
    crossings_.for_each([&](const CrossedTetrahedron& t) {
      ++count_;
      if (count_ <= most) remembered_.push_back(t);
      visit(t);
    });
  }
  template <class Visit>
  void again(Visit visit) {
    if (count_ <= most)
      for (const CrossedTetrahedron& t : remembered_) visit(t);
    else
      crossings_.for_each(visit);
  }

 private:
  Crossings<T>& crossings_;
  std::vector<CrossedTetrahedron> remembered_;
  std::size_t count_ = 0;
};

}  // namespace

// As vector code it counts bits by an instruction.
TAGRID_VECTOR_CODE
void EdgeNumbers::replace(const std::uint64_t* edges, const std::uint32_t* before,
                          std::span<std::array<std::uint32_t, 3>> triangles) {
  for (auto& triangle : triangles)
    for (std::uint32_t& middle : triangle) middle = number_in(edges, before, middle);
}

template <class T>
BrickSurface surface_of_brick(std::span<T> points, const LatticeBits& active, const SurfaceGrid& grid,
                              const SurfaceLevel& level) {
  const Box& box = active.box();
  assert(static_cast<std::int64_t>(points.size()) == box.count() && std::isfinite(level.value));
  BrickSurface surface;
  Crossings<T> crossings(points, active, grid, level);
  EdgeNumbers numbers(box.size());
  // Twice, so that the result has its size from the start, and nothing else grows with the surface.
  TwiceCrossed<T> crossed(crossings);
  std::size_t triangles = 0;
  crossed.first([&](const CrossedTetrahedron& t) {
    for_each_triangle(t, crossings, grid, [&](const std::array<CutEdge, 3>& triangle) {
      for (const CutEdge corner : triangle)
        numbers.add(number_of_middle(t.vertices[corner.a], t.vertices[corner.b]));
      ++triangles;
    });
    surface.border_edges += border_edges_of(t, crossings, grid);
  });
  surface.has_gaps = crossings.has_gaps();
  if (triangles == 0) return surface;
  surface.vertices.resize(numbers.count());
  surface.triangles.reserve(triangles);
  crossed.again([&](const CrossedTetrahedron& t) {
    for_each_triangle(t, crossings, grid, [&](const std::array<CutEdge, 3>& triangle) {
      std::array<std::uint32_t, 3> corners;
      for (std::size_t i = 0; i < 3; ++i) {
        corners[i] = number_of_middle(t.vertices[triangle[i].a], t.vertices[triangle[i].b]);
        if (numbers.is_first(corners[i]))
          surface.vertices[numbers.number(corners[i])] = vertex_on(triangle[i], t, crossings, level.value);
      }
      surface.triangles.push_back(corners);
    });
  });
  numbers.replace_by_numbers(surface.triangles);
  return surface;
}

// Tetrahedra have lattice points as vertices, so each has at least a sixth of a unit cube, and two triangles.
// On the border, a unit square has at most two faces, each with two triangles.
std::uint64_t most_surface_triangles(Index3 size) {
  const Index3 n = size - Index3{1, 1, 1};
  return static_cast<std::uint64_t>(12 * n.x * n.y * n.z + 8 * (n.x * n.y + n.y * n.z + n.x * n.z));
}

// A point is the lower end of at most seven edges, and may itself be a vertex where the surface is closed.
std::uint64_t most_surface_vertices(Index3 size) {
  return 8 * static_cast<std::uint64_t>(size.x * size.y * size.z);
}

std::uint64_t working_bytes_of_surface(SampleType type, Index3 size, int cube_size) {
  // The list of the remembered ones grows by doubling.
  const std::uint64_t tetrahedra =
      std::min<std::uint64_t>(most_surface_triangles(size) / 2, TwiceCrossed<float>::most);
  std::uint64_t bytes = EdgeNumbers::working_bytes(size) + 3 * tetrahedra * sizeof(CrossedTetrahedron) +
                        most_surface_vertices(size) * sizeof(SurfaceVertex) +
                        most_surface_triangles(size) * sizeof(std::array<std::uint32_t, 3>);
  with_sample_type(type, [&](auto t) { bytes += Crossings<decltype(t)>::working_bytes(size, cube_size); });
  return bytes;
}

#define TAGRID_INSTANTIATE(T)                                                                  \
  template BrickSurface surface_of_brick(std::span<T>, const LatticeBits&, const SurfaceGrid&, \
                                         const SurfaceLevel&);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
