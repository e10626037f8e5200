// The flow graph that turns slices into bricks.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "pipeline/encode/slices.h"
#include "pipeline/memory/resources.h"
#include "stages/brick/codec.h"
#include "stages/grid/brick_rows.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {

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

/// Encodes the bricks of `rows` and returns when the last one was written. The bricks do not depend on the
/// budget. The error of a mesh that has a bound is measured on the way; where its values on the low faces
/// follow from the coding of bricks below `rows`, those are encoded first, and not written. An exception in a
/// stream ends the run and is thrown on.
void run_encode_graph(const CodingParameters& parameters, const BrickRows& rows, const EncodeBudget& budget,
                      const EncodeStreams& streams);

}  // namespace tagrid
