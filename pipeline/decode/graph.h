// Decodes bricks: one of them, or rows of them by the flow graph that turns bricks into slices.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "io/tag/blocks.h"
#include "io/tag/index.h"
#include "pipeline/decode/decoded_rows.h"
#include "pipeline/decode/values.h"
#include "pipeline/grid/slices.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "stages/brick/codec.h"
#include "stages/grid/brick_grid.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// The brick of a block. Throws BrokenInput if it cannot be decoded; the message begins with `name`, that of
/// the file, unless it is "". `slices`: see BrickRequest.
DecodedBrick decode_block(const BrickBytes& block, const CodingParameters& parameters,
                          const std::string& name, Wanted wanted, std::int64_t slices = all_slices);

/// The smallest error with which decoded values of this range can be those of a brick of the index.
inline double least_error(const ValueRange& range, const IndexEntry& brick) {
  // Without finite samples both are infinite, and their difference is a NaN, which fmax() ignores.
  return std::fmax(std::fmax(std::abs(range.low - brick.low), std::abs(range.high - brick.high)), 0.0);
}
/// True if the index, whose largest recorded error is `max_error`, allows this range for the brick.
inline bool can_be_of(const ValueRange& range, const IndexEntry& brick, double max_error) {
  return !(least_error(range, brick) > max_error);
}

/// What is decoded: some rows of the bricks of a file.
struct DecodeJob {
  const CodingParameters& parameters;
  DecodeBudget budget;
  BrickRows rows;
  WrittenNumbers numbers = {};  ///< what samples become
};

/// Decodes the rows of a job; `bricks` must give the first of their bricks first. At most the bricks that were
/// read so far are in memory. Throws BrokenInput if a brick does not decode, and the exceptions of `bricks`,
/// `rows` and `watch`; that of `rows` if several fail.
void decode(const DecodeJob& job, BrickSource& bricks, RowSink& rows, Watch& watch);

}  // namespace tagrid
