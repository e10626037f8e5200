// The content of a slice of the phantom, as ellipses to be painted one over the other.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/grid/box.h"

namespace tagrid {

/// The cut of an ellipsoid with a slice, in voxels. For a voxel, q is qz + ((x - cx) / rx)^2 + ((y - cy) /
/// ry)^2; q is below 1 inside. The edge is `blur` voxels wide.
struct PhantomEllipse {
  double cx, cy, rx, ry, qz;
  double blur;
  /// HU at the centre, and by how much they rise per voxel along x and y.
  double value, slope_x = 0, slope_y = 0;
};

/// The value of air in HU.
constexpr double phantom_air = -1000;

/// The ellipses of slice `z`, in the order in which they are painted over air.
std::vector<PhantomEllipse> phantom_ellipses(const Index3& dims, std::uint64_t seed, std::int64_t z);

/// A hash of 64 bits of both arguments.
constexpr std::uint64_t phantom_hash(std::uint64_t a, std::uint64_t b) {
  std::uint64_t h = a * 0x9e3779b97f4a7c15u + b + 0x632be59bd9b4e019u;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
  return h ^ (h >> 31);
}

}  // namespace tagrid
