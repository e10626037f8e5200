// The flow graph that turns slices into bricks.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "grid/coding_parameters.h"
#include "pipeline/brick_rows.h"
#include "pipeline/slices.h"
#include "stages/brick_codec.h"

namespace tagrid {

/// Samples that marks depend on, beyond the root cubes around them: the halo of the stages that make marks.
int mark_halo(const CodingParameters& parameters);

/// The stretches of rows that are encoded for `rows`, which are the last of them.
std::vector<BrickRows> rows_to_encode(const CodingParameters& parameters, const BrickRows& rows);

struct EncodeStreams {
  /// Reads samples: whole rows of one slice, of one z after the other; never called at the same time.
  std::function<SliceSamples(const Box& rows)> read_slice;
  /// Takes the bricks in the order of their numbers, never two at the same time.
  std::function<void(std::int64_t brick, BrickCode code)> write_brick;
  /// Told by a worker that it has encoded a brick, before that is put in order; called at the same time by
  /// several. For tests, which wait here, so that bricks finish in any order. May be empty.
  std::function<void(std::int64_t brick)> brick_done = {};
};

/// How much may be in memory at once.
struct EncodeBudget {
  int threads = 1;
  /// Slices that are read ahead of those that a layer of bricks needs.
  std::int64_t slices_ahead = 0;
  /// Bricks between their subdivision and the writer.
  std::int64_t bricks_in_flight = 1;
};

/// Encodes the bricks of `rows` and returns when the last one was written. The bricks do not depend on the
/// budget. The error of a mesh that has a bound is measured on the way; where its values on the low faces
/// follow from the coding of bricks below `rows`, those are encoded first, and not written. An exception in a
/// stream ends the run and is thrown on.
void run_encode_graph(const CodingParameters& parameters, const BrickRows& rows, const EncodeBudget& budget,
                      const EncodeStreams& streams);

}  // namespace tagrid
