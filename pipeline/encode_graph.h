// The flow graph that turns slices into bricks.
#pragma once

#include <cstdint>
#include <functional>

#include "grid/coding_parameters.h"
#include "pipeline/slices.h"
#include "stages/brick_codec.h"

namespace tagrid {

struct EncodeStreams {
  /// Reads the next slice; called dims.z times, never at the same time.
  std::function<SliceSamples()> read_slice;
  /// Takes the bricks in the order of their numbers, never two at the same time.
  std::function<void(std::int64_t brick, BrickCode code)> write_brick;
  /// Told by a worker that it has encoded a brick, before that is put in order; called at the same time by
  /// several. For tests, which wait here, so that bricks finish in any order. May be empty.
  std::function<void(std::int64_t brick)> brick_done = {};
};

/// Runs the whole encoding on `threads` threads and returns when the last brick was written. What is in
/// flight is bounded: see EncodeSchedule::slices_needed(). The bricks do not depend on the number of threads.
/// An exception in a stream ends the run and is thrown on.
void run_encode_graph(const CodingParameters& parameters, int threads, const EncodeStreams& streams);

}  // namespace tagrid
