// What a worker of the flow graph does: from the slices and marks of a job to the stages of one tile or brick.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "pipeline/encode/schedule.h"
#include "stages/brick/closed_samples.h"
#include "stages/brick/encode.h"
#include "stages/grid/lattice_bits.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {

/// Whether the values of the mesh on the low faces of a brick follow from the bricks below: without loss they
/// are samples, and a grid stores them twice.
inline bool mesh_needs_bricks_below(const CodingParameters& parameters) {
  return parameters.mesh_error >= 0 && parameters.mesh_has_coded_values();
}

struct SubdividedBrick {
  Index3 brick;
  SliceRange slices;
  LatticeBits active;
};

/// What the error of the mesh in a brick follows from.
struct MeshedBrick {
  SubdividedBrick of;
  std::vector<std::byte> values;  ///< of its closed box, as the mesh has them; empty: the original ones
};

struct EncodedBrick {
  std::int64_t id = 0;
  std::shared_ptr<BrickCode> code;
  std::shared_ptr<MeshedBrick> mesh;  ///< where its error has to be measured
};

MarkedTile mark(const MarkJob& job, const CodingParameters& parameters, const EncodeSchedule& schedule);
SubdividedBrick subdivide(const BrickJob& job, const CodingParameters& parameters);
EncodedBrick encode(SubdividedBrick brick, const CodingParameters& parameters);
/// Moves on to `mesh` what the mesh has of a brick as it was coded, completed from the bricks below where there
/// is `closed`. REQUIRES: brick.mesh; bricks come in the order of their numbers.
void take_mesh_values(EncodedBrick& brick, const CodingParameters& parameters, ClosedSamples* closed);
/// Sets the error of the mesh, and forgets what it follows from. REQUIRES: brick.mesh.
void measure_mesh(EncodedBrick& brick, const CodingParameters& parameters);

}  // namespace tagrid
