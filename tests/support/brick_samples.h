// Volumes and their activity cut into bricks, for tests of the brick codecs.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "stages/brick/codec.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"
#include "tests/support/oracle.h"

namespace tagrid {

/// A smooth field with a step and some noise, over the whole range of T.
template <class T>
oracle::Volume<T> random_volume(Index3 dims, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  using Limits = std::numeric_limits<T>;
  const double middle = (double{Limits::max()} + double{Limits::min()}) / 2,
               half = (double{Limits::max()} - double{Limits::min()}) / 2;
  const double noise = random() % 2 ? 0.02 : 1.0;
  return oracle::volume_of<T>(dims, [&](double x, double y, double z) {
    const double v = 0.7 * std::sin(0.3 * x + 0.2 * y) * std::cos(0.1 * z) + (x > y ? 0.4 : -0.2) +
                     noise * (static_cast<double>(random() % 2001) / 1000 - 1);
    return std::clamp(middle + half * v, double{Limits::min()}, double{Limits::max()});
  });
}

/// Closed random marks of the whole padded domain.
inline LatticeBits random_activity_of(const Domain& domain, int marks, std::uint64_t seed) {
  LatticeBits bits(domain.padded());
  std::mt19937_64 random(seed);
  for (int i = 0; i < marks; ++i) {
    const auto unit = static_cast<std::int64_t>(std::uint64_t{1} << random() % 6);
    Index3 p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(bits.box().size()[axis])) /
                unit * unit;
    bits.set(p);
  }
  oracle::close_under_parents(bits, domain.cube_size);
  return bits;
}

inline LatticeBits cut(const LatticeBits& bits, const Box& box) {
  LatticeBits part(box);
  copy_bits(bits, part);
  return part;
}

template <class T>
BrickCode encoded_brick(const oracle::Volume<T>& volume, const LatticeBits& activity,
                        const CodingParameters& parameters, Index3 brick) {
  const Box box = samples_to_encode(parameters, brick);
  const std::vector<T> samples = volume.cut(box);
  BrickCode code;
  encode_brick(Samples<T>{box, samples.data()}, cut(activity, parameters.bricks().closed_box(brick)),
               parameters, brick, code);
  return code;
}

}  // namespace tagrid
