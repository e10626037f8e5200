// What stands at the ends of the flow graphs in tests: functions, and jobs with generous budgets.
#pragma once

#include <cstring>
#include <utility>
#include <vector>

#include "pipeline/decode/graph.h"
#include "pipeline/encode/graph.h"

namespace tagrid {

/// Budgets with which no thread waits for memory. Reads ahead while a layer is encoded: as many slices as the next layer
/// adds.
inline EncodeBudget generous_encoding(const CodingParameters& parameters, int threads) {
  return {threads, parameters.bricks().length(), 16 * std::int64_t{threads}};
}
/// Writes whole layers.
inline DecodeBudget generous_decoding(const CodingParameters& parameters, int threads) {
  return {threads, 16 * std::int64_t{threads}, parameters.bricks().bricks(1)};
}

/// Slices that read(rows) returns.
template <class Read>
class SlicesFrom : public SliceSource {
 public:
  explicit SlicesFrom(Read read) : read_(std::move(read)) {}
  SliceSamples read(const Box& rows) override { return read_(rows); }

 private:
  Read read_;
};

/// Slices of a volume in memory, which must live as long.
template <class T>
auto slices_of(const Index3& dims, const std::vector<T>& samples) {
  return SlicesFrom([dims, &samples](const Box& rows) -> SliceSamples {
    const std::size_t size = static_cast<std::size_t>(rows.count()) * sizeof(T);
    auto bytes = std::make_shared<std::byte[]>(size);
    std::memcpy(bytes.get(), &samples[static_cast<std::size_t>(Box::of_size(dims).offset(rows.low))], size);
    return bytes;
  });
}

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

/// Of a volume of int16 with many bricks.
inline CodingParameters parameters_of_many_bricks(int brick_edge, FileMode mode, double mesh_error = -1) {
  return {.dims = {50, 41, 45},
          .type = SampleType::int16,
          .mode = mode,
          .cube_size = 8,
          .brick_edge = brick_edge,
          .max_level = 9,
          .field_scale = 0.1,
          .max_error = mode == FileMode::voxels ? 3.0 : -1.0,
          .mesh_error = mesh_error};
}

/// Decodes all of a volume at once.
inline DecodeJob decode_job_of(const CodingParameters& parameters, int threads) {
  return {parameters, generous_decoding(parameters, threads), BrickRows::all(parameters.bricks())};
}

}  // namespace tagrid
