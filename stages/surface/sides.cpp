#include "stages/surface/sides.h"

#include <algorithm>
#include <cstddef>

#include "stages/sample/sample_type.h"

namespace tagrid {
namespace {

constexpr std::uint8_t some_outside = 1, some_inside = 2;

// Bits x, x + 1 and x + 2 of a row, joined at bit x.
std::uint64_t of_three(std::uint64_t word, std::uint64_t next) {
  return word | word >> 1 | next << 63 | word >> 2 | next << 62;
}

}  // namespace

std::uint64_t Sides::working_bytes(Index3 size) {
  const auto points = static_cast<std::uint64_t>(size.x * size.y * size.z);
  // Cells of two sizes, the smaller ones an eighth of the points.
  return points + LatticeBits::working_bytes(size) + points / 8 + points / 64;
}

template <class T>
Sides::Sides(std::span<const T> points, const LatticeBits& active_bits, const SurfaceGrid& grid,
             const SurfaceLevel& level)
    : of_point_(points.size()) {
  const Box& box = active_bits.box();
  Cells cells = smallest_cells(active_bits, find_inside(points, active_bits, grid, level));
  for (std::int64_t edge = 2;; edge *= 2) {
    mark_crossed(cells, edge, box, grid);
    if (edge == grid.cube_size) return;
    cells = next_cells(cells);
  }
}

template <class T>
LatticeBits Sides::find_inside(std::span<const T> points, const LatticeBits& active_bits,
                               const SurfaceGrid& grid, const SurfaceLevel& level) {
  const Box& volume = grid.volume;
  bool any_equal = false;
  LatticeBits inside_bits(active_bits.box());
  const auto place = [&](int axis, Index3 p) -> std::uint8_t {
    const std::int64_t at = p[axis], low = volume.low[axis], high = volume.high[axis];
    return at == low || at == high ? border : at < low || at > high ? beyond : 0;
  };
  for_each_set(active_bits, [&](Index3 p, std::size_t i) {
    const auto value = static_cast<double>(points[i]);
    const bool is_inside = level.is_inside(value);
    any_equal |= value == level.value;
    of_point_[i] = static_cast<std::uint8_t>(active | place(0, p) | place(1, p) | place(2, p) |
                                             (is_inside ? inside : 0));
    if (is_inside) inside_bits.set(p);
  });
  if (any_equal) put_outside_those_alone(points, active_bits, grid, level, inside_bits);
  return inside_bits;
}

template <class T>
void Sides::put_outside_those_alone(std::span<const T> points, const LatticeBits& active_bits,
                                    const SurfaceGrid& grid, const SurfaceLevel& level,
                                    LatticeBits& inside_bits) {
  // On edges of root cubes first, then on faces, which may meet such edges, then inside. The test of a
  // point looks at one root cube only, so that every brick finds the same.
  const CommonNeighbours neighbours(active_bits, grid.cube_size);
  bool any = false;
  for (int axes = 1; axes <= 3; ++axes)
    for_each_set(inside_bits, [&](Index3 p, std::size_t i) {
      if (static_cast<double>(points[i]) != level.value || neighbours.axes(p) != axes) return;
      if (!is_alone(p, points, active_bits.box(), neighbours, grid)) return;
      of_point_[i] |= alone;
      any = true;
    });
  if (!any) return;
  for_each_set(inside_bits, [&](Index3 p, std::size_t i) {
    if ((of_point_[i] & alone) == 0) return;
    of_point_[i] = static_cast<std::uint8_t>(of_point_[i] & ~inside);
    inside_bits.clear(p);
  });
}

template <class T>
bool Sides::is_alone(Index3 p, std::span<const T> points, const Box& box, const CommonNeighbours& neighbours,
                     const SurfaceGrid& grid) const {
  const int axes = neighbours.axes(p);
  const T level = points[static_cast<std::size_t>(box.offset(p))];
  // 0: outside. Beyond the volume, there is no surface. 1: of the level. 2: inside, or NaN around which no
  // surface is closed.
  const auto rank = [&](Index3 q) {
    const auto i = static_cast<std::size_t>(box.offset(q));
    if (points[i] != points[i]) return grid.close ? 0 : 2;
    if ((of_point_[i] & (inside | beyond)) != inside) return 0;
    // Of those that were found with this one, none depends on another.
    if ((of_point_[i] & alone) != 0 && neighbours.axes(q) < axes) return 0;
    return points[i] == level ? 1 : 2;
  };
  // Most have such a neighbour at a distance of one, which is found at once: no leaf passes between them.
  for (int axis = 0; axis < 3; ++axis)
    if (neighbours.are_along(axis, p))
      for (const Index3 q : {p - unit_vector(axis), p + unit_vector(axis)})
        if (neighbours.is_vertex(q) && rank(q) == 2) return false;
  return !neighbours.any_leaf(p, [&](std::span<const Index3> of_leaf) {
    int not_outside = 0;
    for (const Index3 q : of_leaf) {
      const int r = rank(q);
      if (r == 2) return true;
      not_outside += r;
    }
    return not_outside >= std::min(axes, 2);
  });
}

Sides::Cells Sides::smallest_cells(const LatticeBits& active_bits, const LatticeBits& inside_bits) {
  const Box& box = active_bits.box();
  Cells cells{{box.size().x / 2, box.size().y / 2, box.size().z / 2}, {}};
  cells.sides.reserve(static_cast<std::size_t>(cells.count.x * cells.count.y * cells.count.z));
  const std::size_t words = active_bits.words_per_row();
  for (std::int64_t z = box.low.z; z < box.high.z; z += 2)
    for (std::int64_t y = box.low.y; y < box.high.y; y += 2) {
      struct Found {
        std::uint64_t inside = 0, outside = 0;
      };
      const auto of_rows = [&](std::size_t w) {
        Found found;
        for (std::int64_t k = 0; k < 3; ++k)
          for (std::int64_t j = 0; j < 3; ++j) {
            const std::uint64_t bits = inside_bits.row(y + j, z + k)[w];
            found.inside |= bits;
            found.outside |= active_bits.row(y + j, z + k)[w] & ~bits;
          }
        return found;
      };
      Found here = of_rows(0);
      for (std::size_t w = 0; w < words; ++w) {
        const Found next = w + 1 < words ? of_rows(w + 1) : Found{};
        const std::uint64_t in = of_three(here.inside, next.inside),
                            out = of_three(here.outside, next.outside);
        const auto first = 64 * static_cast<std::int64_t>(w);
        for (std::int64_t x = first; x < first + 64 && x < box.size().x - 1; x += 2)
          cells.sides.push_back(static_cast<std::uint8_t>((in >> (x - first) & 1 ? some_inside : 0) |
                                                          (out >> (x - first) & 1 ? some_outside : 0)));
        here = next;
      }
    }
  return cells;
}

Sides::Cells Sides::next_cells(const Cells& smaller) {
  const Index3 n = smaller.count;
  Cells cells{{n.x / 2, n.y / 2, n.z / 2}, {}};
  cells.sides.reserve(static_cast<std::size_t>(cells.count.x * cells.count.y * cells.count.z));
  for (std::int64_t z = 0; z < cells.count.z; ++z)
    for (std::int64_t y = 0; y < cells.count.y; ++y)
      for (std::int64_t x = 0; x < cells.count.x; ++x) {
        std::uint8_t sides = 0;
        for (std::int64_t k = 0; k < 2; ++k)
          for (std::int64_t j = 0; j < 2; ++j) {
            const auto at = static_cast<std::size_t>(2 * x + n.x * (2 * y + j + n.y * (2 * z + k)));
            sides = static_cast<std::uint8_t>(sides | smaller.sides[at] | smaller.sides[at + 1]);
          }
        cells.sides.push_back(sides);
      }
  return cells;
}

void Sides::mark_crossed(const Cells& cells, std::int64_t edge, const Box& box, const SurfaceGrid& grid) {
  const auto reaches_border = [&](int axis, std::int64_t cell) {
    const std::int64_t low = box.low[axis] + cell * edge;
    return grid.close && (low <= grid.volume.low[axis] || low + edge >= grid.volume.high[axis]);
  };
  const Index3 size = box.size();
  auto sides = cells.sides.begin();
  for (std::int64_t z = 0; z < cells.count.z; ++z)
    for (std::int64_t y = 0; y < cells.count.y; ++y) {
      const bool at_border = reaches_border(1, y) || reaches_border(2, z);
      std::int64_t centre = edge / 2 + size.x * (y * edge + edge / 2 + size.y * (z * edge + edge / 2));
      for (std::int64_t x = 0; x < cells.count.x; ++x, ++sides, centre += edge)
        if (*sides == (some_inside | some_outside) ||
            (*sides == some_inside && (at_border || reaches_border(0, x))))
          of_point_[static_cast<std::size_t>(centre)] |= crossed;
    }
}

#define TAGRID_INSTANTIATE(T) \
  template Sides::Sides(std::span<const T>, const LatticeBits&, const SurfaceGrid&, const SurfaceLevel&);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
