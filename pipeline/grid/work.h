// The work of one job that the schedule gives: slices and marks are passed to the stages of one tile or brick.
#pragma once

#include "pipeline/grid/schedule.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

struct SubdividedBrick {
  Index3 brick;
  SliceRange slices;
  LatticeBits active;
};

MarkedTile mark(const MarkJob& job, const CodingParameters& parameters, const GridSchedule& schedule);
/// Without marks around the brick: no grid, and an empty activity.
SubdividedBrick subdivide(const BrickJob& job, const CodingParameters& parameters);

}  // namespace tagrid
