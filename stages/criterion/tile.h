// The marks of one tile: what both criteria say of the points of a few root cubes.
#pragma once

#include <cstdint>

#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/samples.h"

namespace tagrid {

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
