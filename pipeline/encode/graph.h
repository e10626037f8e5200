// The flow graph that turns slices into bricks.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <utility>
#include <vector>

#include "io/tag/blocks.h"
#include "pipeline/grid/schedule.h"
#include "pipeline/grid/slices.h"
#include "pipeline/memory/plan.h"
#include "pipeline/memory/resources.h"
#include "pipeline/overview/sums.h"
#include "pipeline/progress/progress.h"
#include "stages/brick/codec.h"
#include "stages/grid/box.h"
#include "stages/grid/brick_grid.h"
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
  /// Called with each slice that was read for the bricks that are written, in the order of z. May be empty.
  std::function<void(const Box& rows, const std::byte* samples)> see_slice = {};
};

/// Encodes the bricks of `rows`, and returns when the last one has been written. The bricks do not depend on
/// the budget. If the mesh has a bound, its error is measured along the way. If its values on the low faces
/// depend on the coding of bricks below `rows`, those bricks are encoded first and not written. An exception
/// in a stream ends the run and is rethrown.
void run_encode_graph(const CodingParameters& parameters, const BrickRows& rows, const EncodeBudget& budget,
                      const EncodeStreams& streams);

/// Encodes the bricks of a volume according to a plan: all at once, or one part after the other.
class RowEncoder {
 public:
  /// Reads complete rows of one slice. Slices come in the order of z.
  using ReadSlice = std::function<SliceSamples(const Box& rows)>;

  /// `parameters` must outlive the encoder.
  RowEncoder(const CodingParameters& parameters, EncodePlan plan, ReadSlice read_slice)
      : parameters_(parameters), plan_(std::move(plan)), read_slice_(std::move(read_slice)) {}

  /// From now on, also sums blocks, and passes the sums that belong to the rows. See pipeline/overview.
  void sum_blocks(StripSums::Out out) { sums_out_ = std::move(out); }
  /// Encodes `rows`. Throws the exceptions of reading, `sink` and `watch`; that of `sink` if several fail.
  void encode(const BrickRows& rows, BrickSink& sink, const Watch& watch);
  /// Becomes true when a sink fails. A source that waits for samples may then give up.
  const std::atomic<bool>& failed() const { return failed_; }

 private:
  const CodingParameters& parameters_;
  EncodePlan plan_;
  ReadSlice read_slice_;
  StripSums::Out sums_out_;
  std::exception_ptr failure_;  ///< of a sink
  std::atomic<bool> failed_{false};
};

/// The samples that are read to encode `rows`, box after box; of each box, slice after slice.
std::vector<Box> samples_in_order(const CodingParameters& parameters, const EncodePlan& plan,
                                  const BrickRows& rows);

/// How often a sample of a volume is read, on average, to encode all `parts`.
double times_read(const CodingParameters& parameters, const EncodePlan& plan,
                  const std::vector<BrickRows>& parts);

}  // namespace tagrid
