// Runs the encoder's stages up to the activity on a whole volume at once, and reads test volumes.
#pragma once

#include <bit>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "stages/criterion/curvature.h"
#include "stages/criterion/marking.h"
#include "stages/criterion/subdivide.h"
#include "stages/grid/brick_grid.h"
#include "tests/support/oracle.h"

namespace tagrid {

/// The field on `box` (even corners), at every second point.
template <class T>
CurvatureField curvature_of(const oracle::Volume<T>& volume, const Box& box, double scale) {
  const Box read = box.grown(CurvatureField::halo);
  const std::vector<T> samples = volume.cut(read);
  CurvatureField field(box, 2, (box.size().z + 1) / 2);
  for (std::int64_t z = box.low.z; z <= box.high.z; z += 2)
    evaluate_curvature(Samples<T>{read, samples.data()}, z, scale, field);
  return field;
}

/// Curvature marks of `box`, computed from the field of `cubes`, a box of whole root cubes around it.
template <class T>
LatticeBits marks_of(const oracle::Volume<T>& volume, int cube_size, const MarkingParameters& parameters,
                     const Box& cubes, const Box& box) {
  const Box read = cubes.grown(CurvatureField::halo);
  const std::vector<T> samples = volume.cut(read);
  LatticeBits marks(box);
  mark_curvature(Samples<T>{read, samples.data()}, cubes, volume.domain(cube_size), parameters, marks);
  return marks;
}

template <class T>
LatticeBits marks_of(const oracle::Volume<T>& volume, int cube_size, const MarkingParameters& parameters) {
  const Box all = volume.domain(cube_size).padded();
  return marks_of(volume, cube_size, parameters, all, all);
}

template <class T>
LatticeBits activity_of(const oracle::Volume<T>& volume, int cube_size, const MarkingParameters& parameters) {
  LatticeBits bits = marks_of(volume, cube_size, parameters);
  close_under_parents(bits, cube_size);
  return bits;
}

inline std::int64_t count_of(const LatticeBits& bits) {
  std::int64_t n = 0;
  for (const std::uint64_t word : bits.words()) n += std::popcount(word);
  return n;
}

/// Raw samples of one of the volumes beside the source tree; none if the file is missing.
template <class T>
oracle::Volume<T> read_volume(const std::string& name, Index3 dims) {
  oracle::Volume<T> volume{dims, {}};
  std::ifstream file(std::string(TAGRID_SOURCE_DIR) + "/../shared/data/" + name, std::ios::binary);
  if (!file) return volume;
  volume.samples.resize(static_cast<std::size_t>(Box::of_size(dims).count()));
  file.read(reinterpret_cast<char*>(volume.samples.data()),
            static_cast<std::streamsize>(volume.samples.size() * sizeof(T)));
  if (!file) volume.samples.clear();
  return volume;
}

}  // namespace tagrid
