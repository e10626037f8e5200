// The halo of marks.
#pragma once

#include <algorithm>

#include "stages/marks/curvature.h"
#include "stages/marks/mesh_criterion.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {

/// The number of samples, beyond the surrounding root cubes, on which marks depend: the halo of the stages
/// that make marks.
inline int mark_halo(const CodingParameters& parameters) {
  return parameters.bounds_interpolation()
             ? std::max(CurvatureField::halo, mesh_criterion_halo(parameters.cube_size))
             : CurvatureField::halo;
}

}  // namespace tagrid
