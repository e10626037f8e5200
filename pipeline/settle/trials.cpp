#include "pipeline/settle/trials.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "io/tag/blocks.h"
#include "io/volume/one_of_volumes.h"
#include "pipeline/encode/graph.h"
#include "pipeline/settle/source_survey.h"
#include "pipeline/slices/slices_ahead.h"
#include "stages/sample/filter_fit.h"
#include "stages/sample/statistics.h"

namespace tagrid {
namespace {

// Counts the bricks of an encoding instead of writing them.
class BrickCounter : public BrickSink {
 public:
  void write_brick(const BrickBytes& brick, const Statistics& statistics) override {
    bytes += block_frame_size + brick.values.size();
    all.add(statistics);
  }

  std::uint64_t bytes = 0;
  Statistics all;
};

}  // namespace

Trials::Trials(VolumeSource& source, CodingParameters parameters, const EncodePlan& plan, int usual_edge,
               double peak, std::int64_t most_sampled, const Progress& progress)
    : source_(source),
      parameters_(std::move(parameters)),
      plan_(plan),
      usual_edge_(usual_edge),
      peak_(peak),
      most_sampled_(most_sampled),
      progress_(progress) {
  // Of the voxels alone: a grid changes no decoded sample.
  parameters_.mesh_error = -1;
  parameters_.grid = GridOrigin::derived;
}

bool Trials::has_parts() const {
  const Index3& dims = source_.info().dims;
  return dims.x * dims.y * dims.z > most_sampled_;
}

void Trials::fit_filter(double max_error, double step) {
  FilterSums sums;
  CodingParameters parameters = parameters_;
  parameters.brick_edge = has_parts() ? usual_edge_ : parameters.brick_edge;
  parameters.max_error = max_error;
  parameters.transform_step = step;
  parameters.filter = {};
  encode(parameters, has_parts(), &sums);
  set_filter(fitted_weights(sums));
}

void Trials::set_filter(const FilterWeights& weights) {
  parameters_.filter = weights;
  std::erase_if(earlier_, [](const auto& tried) { return std::get<1>(tried.first) > 0; });
}

const Tried& Trials::of(double max_error, double step, bool sampled) {
  // A small volume is its own sample.
  sampled = sampled && has_parts();
  const auto [at, is_new] = earlier_.try_emplace({max_error, step, sampled});
  if (!is_new) return at->second;
  CodingParameters parameters = parameters_;
  if (sampled || step == 0) parameters.brick_edge = usual_edge_;
  parameters.max_error = max_error;
  parameters.transform_step = step;
  if (step == 0) parameters.filter = {};
  return at->second = encode(parameters, sampled);
}

std::vector<std::vector<BrickRows>> Trials::rows_of_volumes(const BrickGrid& bricks, bool sampled) const {
  constexpr std::int64_t least_rows = 8;
  const std::int64_t volumes = source_.info().volumes, ny = bricks.bricks(1), rows = ny * bricks.bricks(2),
                     all_rows = rows * volumes,
                     per_row = std::max<std::int64_t>(bricks.domain.volume().count() / rows, 1);
  std::vector<std::vector<BrickRows>> chosen(static_cast<std::size_t>(volumes));
  if (!sampled) {
    for (std::vector<BrickRows>& of_volume : chosen) of_volume = {BrickRows::all(bricks)};
    return chosen;
  }
  const std::int64_t wanted = std::min(std::max(most_sampled_ / per_row, least_rows), all_rows);
  for (std::int64_t i = 0; i < wanted; ++i) {
    const std::int64_t row = spread_row(i, wanted, all_rows), y = row % rows % ny, z = row % rows / ny;
    chosen[static_cast<std::size_t>(row / rows)].push_back({y, y + 1, z, z + 1});
  }
  return chosen;
}

Tried Trials::encode(const CodingParameters& parameters, bool sampled, FilterSums* filter_sums) {
  const BrickGrid bricks = parameters.bricks();
  EncodeJob job{.header = {parameters, {}}, .plan = plan_, .filter_sums = filter_sums};
  // The plan counts rows of larger bricks.
  job.plan.rows *= std::max(parameters_.brick_edge / parameters.brick_edge, 1);
  const std::vector<std::vector<BrickRows>> chosen = rows_of_volumes(bricks, sampled);
  std::uint64_t samples = 0;
  for (const std::vector<BrickRows>& of_volume : chosen)
    for (const BrickRows& rows : of_volume) samples += static_cast<std::uint64_t>(rows.owned(bricks).count());
  ProgressWatch watch(progress_, samples * size_of(parameters.type));
  BrickCounter counter;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const auto volume = one_of_volumes(source_, static_cast<std::int64_t>(i));
    SlicesAhead slices(*volume, 0);
    tagrid::encode(job, chosen[i], slices, counter, watch);
    times_read_ += tagrid::times_read(parameters, job.plan, chosen[i]) / static_cast<double>(chosen.size());
  }
  const Statistics& all = counter.all;
  Tried tried{INFINITY, 0, all.max_error,
              8 * static_cast<double>(counter.bytes) / static_cast<double>(all.samples)};
  if (all.finite == 0 || all.max_error == 0) return tried;
  tried.rmse = achieved_of(all).rmse;
  // Squares of very small errors are 0.
  if (tried.rmse == 0) tried.rmse = all.max_error;
  tried.psnr = 20 * std::log10(peak_ / tried.rmse);
  // The bound is kept before samples are moved to their sides. With a smaller one, the file would not be that of the trial.
  if (parameters.transform_step > 0 && parameters.thresholds.count > 0) {
    CodingParameters unmoved = parameters;
    unmoved.thresholds = {};
    tried.max_error = encode(unmoved, sampled).max_error;
  }
  return tried;
}

}  // namespace tagrid
