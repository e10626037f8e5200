// The voxels of one brick, and the bounds that hold for them.
#pragma once

#include "stages/bound/bounds.h"
#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// What the encoder and the decoder of a brick's voxels both know.
template <class Bounds>
struct BrickOfVoxels {
  Box owned;  ///< of the voxels; not empty
  /// Of a box that contains `owned`; only needed with a surface_error.
  const LatticeBits* activity = nullptr;
  Bounds bounds;
  Effort effort = Effort::normal;
};
using VoxelBrick = BrickOfVoxels<VoxelBounds>;

}  // namespace tagrid
