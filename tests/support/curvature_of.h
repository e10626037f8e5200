// The curvature of a volume that is in memory, with all slices at once.
#pragma once

#include <vector>

#include "stages/criterion/curvature.h"
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

}  // namespace tagrid
