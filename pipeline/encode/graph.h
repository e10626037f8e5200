// The flow graph that turns slices into bricks.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "pipeline/grid/schedule.h"
#include "pipeline/grid/slices.h"
#include "pipeline/memory/resources.h"
#include "stages/brick/codec.h"
#include "stages/grid/brick_rows.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// The stretches of rows that must be encoded for `rows`, which is the last of them.
std::vector<BrickRows> rows_to_encode(const CodingParameters& parameters, const BrickRows& rows);

/// The schedule for one of these stretches.
GridSchedule schedule_of_encoding(const CodingParameters& parameters, const BrickRows& rows);

struct EncodeStreams {
  /// Reads samples: complete rows of one slice, in the order of z. Never called by two threads at once.
  std::function<SliceSamples(const Box& rows)> read_slice;
  /// Takes the bricks in the order of their numbers. Never called by two threads at once.
  std::function<void(std::int64_t brick, BrickCode code)> write_brick;
  /// Called by a worker when it has encoded a brick, before the brick is put in order; several workers may
  /// call it at once. For tests, which wait here so that bricks finish in any order. May be empty.
  std::function<void(std::int64_t brick)> brick_done = {};
  /// Called before each slice is read; an exception ends the run. May be empty.
  std::function<void()> before_reading = {};
};

/// Encodes the bricks of `rows`, and returns when the last one has been written. The bricks do not depend on
/// the budget. If the mesh has a bound, its error is measured along the way. If its values on the low faces
/// depend on the coding of bricks below `rows`, those bricks are encoded first and not written. An exception
/// in a stream ends the run and is rethrown.
void run_encode_graph(const CodingParameters& parameters, const BrickRows& rows, const EncodeBudget& budget,
                      const EncodeStreams& streams);

}  // namespace tagrid
