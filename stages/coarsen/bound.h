// The bound of a coarsened mesh.
#pragma once

#include "stages/grid/box.h"

namespace tagrid {

/// A mesh that must be near the samples.
struct MeshBound {
  Index3 dims;          ///< of the volume
  int cube_size = 32;   ///< S
  double largest = 0;   ///< no sample may be further than this from the mesh; at least 0, in units of samples
  bool padded = false;  ///< the mesh is not cut at the border of the volume
};

}  // namespace tagrid
