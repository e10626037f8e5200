// Decodes bricks: one of them, or rows of them by the flow graph that turns bricks into slices, as a plan says that
// fits into memory (plan.cpp).
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

/// How decoded bricks are used.
enum class DecodeUse {
  write,          ///< Samples are written in any order.
  stream,         ///< Samples are written in raster order.
  verify,         ///< Bricks are checked, and samples compared with rows in any order.
  verify_stream,  ///< The same, with rows in raster order.
  mesh,           ///< Complete layers are made into tetrahedra.
};

/// The amount of work that is in memory while rows of bricks are decoded.
struct DecodeLoad {
  std::int64_t threads = 1, rows = 1, bricks_in_flight = 1;
  bool with_grid = false;       ///< grids are decoded, or derived where bricks have none
  std::size_t value_bytes = 0;  ///< of each value that samples become; 0: they stay as they are
  /// The most memory of what takes the bricks and rows; nullptr: it keeps nothing.
  double (*kept)(const CodingParameters& parameters, const DecodeLoad& load) = nullptr;
};
std::uint64_t memory_of_decoding(const CodingParameters& parameters, const DecodeLoad& load);

struct DecodePlan {
  DecodeBudget budget;
  std::uint64_t memory = 0;
  /// The ordered stream (the output or the original) goes through a file.
  bool spooled = false;
  /// Verifying computes the grid, which bricks do not have: there is memory for the layers that this takes.
  bool derives = false;
};

/// The plan with the largest pieces, and then the most threads. Throws as plan_encoding() does. `besides`:
/// memory of the writer, or of the reader of an original. `value_bytes`, `kept`: see DecodeLoad.
DecodePlan plan_decoding(const CodingParameters& parameters, const Resources& resources,
                         DecodeUse use = DecodeUse::write, std::uint64_t besides = 0,
                         std::size_t value_bytes = 0, decltype(DecodeLoad::kept) kept = nullptr);

/// The memory of bricks that are read one by one, by threads that store samples and grids elsewhere.
std::uint64_t memory_of_reading(const CodingParameters& parameters, std::int64_t threads,
                                bool with_grid = false);

}  // namespace tagrid
