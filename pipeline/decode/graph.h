// Decodes bricks: one of them, or rows of them by the flow graph that turns bricks into slices.
#pragma once

#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <string>
#include <utility>

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

struct DecodeStreams {
  BrickStream bricks;
  /// Takes groups of rows of bricks in the order of their numbers. Never called by two threads at once. Every
  /// brick in them has been decoded without an error. May be empty.
  std::function<void(const DecodedRows& rows)> write_rows;
  /// Takes every brick, in order, before write_rows has its samples. May move the rest out. May be empty.
  std::function<void(DecodedBrick&)> inspect_brick;
  /// See EncodeStreams.
  std::function<void(std::int64_t brick)> brick_done = {};
  std::function<void()> before_reading = {};  ///< the same, before each brick
  /// Converts a brick's samples to `sample_bytes` each. Called by several threads at once. May be empty.
  std::function<void(DecodedBrick&)> change_samples = {};
  std::size_t sample_bytes = 0;  ///< 0: those of the type of the volume
};

/// Decodes the bricks of `rows`; streams.bricks must give the first of them first. At most the bricks that
/// were read so far are in memory. Throws BrokenInput if a brick does not decode.
void run_decode_graph(const CodingParameters& parameters, const BrickRows& rows, const DecodeBudget& budget,
                      const DecodeStreams& streams);

/// Decodes the bricks of a file: all at once, or one part after the other.
class RowDecoder {
 public:
  /// Rows have `numbers`.
  RowDecoder(const CodingParameters& parameters, const DecodeBudget& budget, WrittenNumbers numbers = {})
      : parameters_(parameters), budget_(budget), numbers_(std::move(numbers)) {}

  /// Becomes true if samples cannot be written, so that a reader that waits can give up.
  const std::atomic<bool>& failed() const { return failed_; }

  /// Decodes `rows`, of which `bricks` must give the first first, and passes rows to `write` in the order of
  /// bricks. Throws the exceptions of reading, `write` and `watch`; that of `write` if several fail.
  void decode(const BrickRows& rows, const BrickStream& bricks,
              const std::function<void(const DecodedRows&)>& write, const Watch& watch);

 private:
  CodingParameters parameters_;
  DecodeBudget budget_;
  WrittenNumbers numbers_;
  std::exception_ptr failure_;  ///< of `write`
  std::atomic<bool> failed_{false};
};

}  // namespace tagrid
