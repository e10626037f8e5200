// Marks: the lattice points whose base edge violates the accuracy criterion, and with the second criterion
// (mesh_criterion.h) the marks of one tile, which is a few root cubes.
//
// A mark is a function of the samples only. It never depends on a decision made elsewhere, so every brick is
// independent of every other.
#pragma once

#include <array>
#include <cstdint>

#include "stages/criterion/criterion.h"
#include "stages/criterion/curvature.h"
#include "stages/grid/box.h"
#include "stages/grid/brick_grid.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/samples.h"

namespace tagrid {

struct MarkingParameters {
  int accuracy = 20;       ///< m of the criterion
  double field_scale = 0;  ///< voxels per unit of field value
  int max_level = 24;      ///< points of a higher level get no mark (limited run)
};

/// Marks the points of `marks.box()` that lie in the volume; other bits stay as they are.
/// `cubes`: a box of complete root cubes that contains marks.box(). REQUIRES: samples.box contains
/// cubes.grown(CurvatureField::halo). T: see evaluate_curvature().
template <class T>
void mark_curvature(const Samples<T>& samples, const Box& cubes, const Domain& domain,
                    const MarkingParameters& parameters, LatticeBits& marks);

/// The same for three thresholds: the points whose excess is more than 0.6, 1, and 1.6 times what the
/// criterion allows. Only edges that VarianceTest finds are measured. REQUIRES: the sets have the same box.
template <class T>
void grade_curvature(const Samples<T>& samples, const Box& cubes, const Domain& domain,
                     const MarkingParameters& parameters,
                     std::array<LatticeBits, CriterionParameters::excesses>& sets);

/// The peak of the heap that both take for root cubes of `cubes` points.
std::uint64_t working_bytes_of_curvature(Index3 cubes, int cube_size);

/// The number of samples, beyond the surrounding root cubes, on which marks depend: the halo of the stages
/// that make marks.
int mark_halo(const CodingParameters& parameters);

/// The marks of the points of `marked`; bits without a box if there is nothing to mark. `cubes`: complete
/// root cubes that contain `marked`. REQUIRES: samples.box contains cubes.grown(mark_halo(parameters)).
LatticeBits mark_tile(const BrickSamples& samples, const Box& cubes, const Box& marked,
                      const CodingParameters& parameters);

/// The peak of the heap that mark_tile() takes for root cubes of `cubes` points, not including the halo: the
/// marks, with the curvature and the heights of wide samples first, and then with the mesh criterion.
std::uint64_t working_bytes_of_marking(const CodingParameters& parameters, Index3 cubes);

}  // namespace tagrid
