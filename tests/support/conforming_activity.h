// Random conforming activity for tests, closed by the simplest possible loop.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "stages/grid/lattice.h"
#include "stages/grid/lattice_bits.h"
#include "tests/support/points.h"

namespace tagrid {

template <class F>
void for_each_point(const Box& box, F f) {
  for (const auto [x, y, z] : points_of(box)) f(Index3{x, y, z});
}

/// Adds root corners, and then the parents of active points until nothing changes.
inline void close_naively(LatticeBits& bits, int cube_size) {
  for_each_point(bits.box(), [&](Index3 p) {
    if (classify(p, cube_size).odd == 0) bits.set(p);
  });
  for (int level = max_level(cube_size); level > 1; --level)
    for_each_point(bits.box(), [&](Index3 p) {
      const PointClass c = classify(p, cube_size);
      if (c.level != level || !bits.test(p)) return;
      for (Index3 parent : parents(p, c, cube_size))
        if (bits.box().contains(parent)) bits.set(parent);
    });
}

/// `marks` random marks, on levels of all units.
inline LatticeBits random_marks(const Box& box, int marks, std::uint64_t seed) {
  LatticeBits bits(box);
  std::mt19937_64 random(seed);
  for (int i = 0; i < marks; ++i) {
    const auto unit = static_cast<std::int64_t>(std::uint64_t{1} << random() % 8);
    Index3 p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] =
          static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(box.size()[axis])) / unit * unit;
    bits.set(box.low + p);
  }
  return bits;
}

/// `marks` random marks, closed in `box`, which is its own domain.
inline LatticeBits random_conforming_activity(const Box& box, int cube_size, int marks, std::uint64_t seed) {
  LatticeBits bits(box);
  std::mt19937_64 random(seed);
  const auto below = [&](std::int64_t n) {
    return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(n));
  };
  const Index3 size = box.size();
  for (int i = 0; i < marks; ++i) {
    // Rounded to a random unit, so that coarse levels get marks of their own.
    const std::int64_t unit = std::int64_t{1} << below(8);
    Index3 p = box.low + Index3{below(size.x), below(size.y), below(size.z)};
    if (unit <= cube_size) p = {p.x / unit * unit, p.y / unit * unit, p.z / unit * unit};
    bits.set(p);
  }
  close_naively(bits, cube_size);
  return bits;
}

}  // namespace tagrid
