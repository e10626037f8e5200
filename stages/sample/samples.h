// Samples of a box of the lattice.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"

namespace tagrid {

/// Distances of neighboring samples in memory, in bytes, along x, y and z.
using Strides = std::array<std::int64_t, 3>;

/// A view of the samples of `box`, x fastest.
template <class T>
struct Samples {
  Box box;
  const T* data = nullptr;

  const T& at(Index3 p) const { return data[box.offset(p)]; }
  const T* row(std::int64_t y, std::int64_t z) const {
    return data + ((z - box.low.z) * box.size().y + (y - box.low.y)) * box.size().x;
  }
};

/// The samples of `box` as bytes, stored as in memory, in the type of the volume, x fastest.
struct BrickSamples {
  Box box;
  std::vector<std::byte> bytes;

  /// REQUIRES: T is the type of the volume.
  template <class T>
  Samples<T> as() const {
    return {box, reinterpret_cast<const T*>(bytes.data())};
  }
};

/// True if all samples are equal. REQUIRES: one or more integers.
template <class T>
bool all_equal(std::span<const T> samples) {
  return std::equal(samples.begin() + 1, samples.end(), samples.begin());
}

}  // namespace tagrid
