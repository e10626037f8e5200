#include "pipeline/job/trials.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "io/tag/blocks.h"
#include "io/volume/one_of_volumes.h"
#include "pipeline/job/source_survey.h"
#include "stages/brick/codec.h"
#include "stages/sample/statistics.h"

namespace tagrid {

Trials::Trials(VolumeSource& source, CodingParameters parameters, int usual_edge, double peak,
               std::int64_t most_sampled, const Progress& progress)
    : source_(source),
      parameters_(std::move(parameters)),
      usual_edge_(usual_edge),
      peak_(peak),
      most_sampled_(most_sampled),
      progress_(progress) {
  // Of the voxels alone: a grid changes no decoded sample.
  parameters_.mesh_error = -1;
  parameters_.grid = GridOrigin::derived;
}

const Tried& Trials::of(double max_error, double step, bool sampled) {
  // A small volume is its own sample.
  const Index3& dims = source_.info().dims;
  sampled = sampled && dims.x * dims.y * dims.z > most_sampled_;
  const auto [at, is_new] = earlier_.try_emplace({max_error, step, sampled});
  if (!is_new) return at->second;
  CodingParameters parameters = parameters_;
  if (sampled || step == 0) parameters.brick_edge = usual_edge_;
  parameters.max_error = max_error;
  parameters.transform_step = step;
  return at->second = encode(parameters, sampled);
}

Tried Trials::encode(const CodingParameters& parameters, bool sampled) {
  const BrickGrid bricks = parameters.bricks();
  const std::int64_t rows = bricks.bricks(1) * bricks.bricks(2), all_rows = rows * source_.info().volumes;
  const std::int64_t per_row = std::max<std::int64_t>(parameters.domain().volume().count() / rows, 1);
  constexpr std::int64_t least_rows = 8;
  const std::int64_t wanted =
      sampled ? std::min(std::max(most_sampled_ / per_row, least_rows), all_rows) : all_rows;
  const std::uint64_t bytes_per_row = static_cast<std::uint64_t>(per_row) * size_of(parameters.type);
  ProgressWatch watch(progress_, static_cast<std::uint64_t>(wanted) * bytes_per_row);
  Statistics all;
  std::atomic<std::uint64_t> bytes = 0;
  for (std::int64_t i = 0; i < wanted; ++i) {
    std::vector<Statistics> of_brick(static_cast<std::size_t>(bricks.bricks(0)));
    const std::int64_t row = spread_row(i, wanted, all_rows);
    const auto volume = one_of_volumes(source_, row / rows);
    for_each_brick_of_row(*volume, bricks, row % rows, [&](std::int64_t id, const BrickSamples& samples) {
      const Index3 position = bricks.position(id);
      BrickCode code;
      encode_brick(samples, {}, parameters, position, code);
      of_brick[static_cast<std::size_t>(position.x)] = code.statistics;
      bytes += block_frame_size + code.values.size();
    });
    // In the order of bricks: sums of floats depend on it.
    for (const Statistics& s : of_brick) all.add(s);
    watch.done(bytes_per_row);
  }
  times_read_ += static_cast<double>(wanted) / static_cast<double>(all_rows);
  Tried tried{INFINITY, 0, all.max_error, 8 * static_cast<double>(bytes) / static_cast<double>(all.samples)};
  if (all.finite == 0 || all.max_error == 0) return tried;
  tried.rmse = achieved_of(all).rmse;
  // Squares of very small errors are 0.
  if (tried.rmse == 0) tried.rmse = all.max_error;
  tried.psnr = 20 * std::log10(peak_ / tried.rmse);
  return tried;
}

}  // namespace tagrid
