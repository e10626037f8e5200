// What stands at the ends of the flow graphs in tests: functions, and jobs with generous budgets.
#pragma once

#include <utility>

#include "pipeline/decode/graph.h"
#include "pipeline/encode/graph.h"
#include "tests/support/generous_budgets.h"

namespace tagrid {

/// Slices that read(rows) returns.
template <class Read>
class SlicesFrom : public SliceSource {
 public:
  explicit SlicesFrom(Read read) : read_(std::move(read)) {}
  SliceSamples read(const Box& rows) override { return read_(rows); }

 private:
  Read read_;
};

/// Passes bricks to write(brick, statistics).
template <class Write>
class BricksInto : public BrickSink {
 public:
  explicit BricksInto(Write write) : write_(std::move(write)) {}
  void write_brick(const BrickBytes& brick, const Statistics& statistics) override {
    write_(brick, statistics);
  }

 private:
  Write write_;
};

/// Passes on which bricks are done, in whatever order.
template <class Done>
class WatchBricks : public Watch {
 public:
  explicit WatchBricks(Done done) : done_(std::move(done)) {}
  void brick_done(std::int64_t brick) override { done_(brick); }

 private:
  Done done_;
};

/// Encodes all of a volume at once.
inline EncodeJob job_of(const CodingParameters& parameters, const EncodeBudget& budget) {
  EncodeJob job;
  job.header.parameters = parameters;
  job.plan = {.budget = budget, .rows = parameters.bricks().bricks(1)};
  return job;
}
inline EncodeJob job_of(const CodingParameters& parameters, int threads) {
  return job_of(parameters, generous_encoding(parameters, threads));
}

/// Decodes all of a volume at once.
inline DecodeJob decode_job_of(const CodingParameters& parameters, int threads) {
  return {parameters, generous_decoding(parameters, threads), BrickRows::all(parameters.bricks())};
}

}  // namespace tagrid
