// A synthetic CT volume of any size, for tests and measurements: tissue with slow gradients, bones, lungs,
// foam, thin shells and metal in a patient on a table, with correlated noise, inside a round field of view.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"

namespace tagrid {

/// Makes slice `z` of a volume of size `dims`: dims.x * dims.y samples, x fastest. A pure function of its
/// arguments, with the same samples on every machine. Slices can be made in any order, and each takes the
/// same time, whatever z is. The content scales with dims.x and dims.y, and varies without end along z.
///
/// Samples of int16 and int32 are in HU, -1024 to 3071 (-1024 outside the field of view). Samples of uint16
/// and uint32 are in HU + 1024. Samples of 8 bits are in steps of 10 HU, from the type's lowest value on.
/// Floats are in HU, not rounded. REQUIRES: positive sizes, 0 <= z < dims.z, out.size() == dims.x * dims.y.
/// T: the sample types.
template <class T>
void phantom_slice(const Index3& dims, std::uint64_t seed, std::int64_t z, std::span<T> out);

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
