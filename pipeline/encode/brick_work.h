// The work on one brick in the flow graph after it was subdivided: it is encoded, and its mesh is measured.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "pipeline/grid/schedule.h"
#include "stages/brick/closed_samples.h"
#include "stages/brick/codec.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// The input for measuring the error of the mesh in a brick.
struct MeshedBrick {
  SubdividedBrick of;
  std::vector<std::byte> values;  ///< of the mesh, in the brick's closed box; empty: the original samples
};

struct EncodedBrick {
  std::int64_t id = 0;
  std::shared_ptr<BrickCode> code;
  std::shared_ptr<MeshedBrick> mesh;  ///< only if its error has to be measured
};

EncodedBrick encode(SubdividedBrick brick, const CodingParameters& parameters);
/// Moves the mesh's values of an encoded brick to `mesh`, completed from the bricks below if `closed` is
/// given. REQUIRES: brick.mesh; bricks come in the order of their numbers.
void take_mesh_values(EncodedBrick& brick, const CodingParameters& parameters, ClosedSamples* closed);
/// Sets the error of the mesh, and frees the input for it. REQUIRES: brick.mesh.
void measure_mesh(EncodedBrick& brick, const CodingParameters& parameters);

}  // namespace tagrid
