#include "pipeline/grid/derived_grid.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <utility>

#include "stages/criterion/tile.h"

namespace tagrid {

DerivedGrid::DerivedGrid(const CodingParameters& parameters, const BrickRows& rows, Take take)
    : parameters_(parameters), schedule_(parameters, rows, mark_halo(parameters)), take_(std::move(take)) {}

std::vector<BrickRows> DerivedGrid::stretches() const {
  const BrickGrid bricks = parameters_.bricks();
  const Box& box = samples();
  const BrickRows rows = {bricks.owner(box.low.y), bricks.owner(box.high.y) + 1, bricks.owner(box.low.z),
                          bricks.owner(box.high.z) + 1};
  if (rows.y_low == 0 && rows.y_end == bricks.bricks(1)) return {rows};
  std::vector<BrickRows> layers;
  for (std::int64_t z = rows.z_low; z < rows.z_end; ++z) layers.push_back({rows.y_low, rows.y_end, z, z + 1});
  return layers;
}

void DerivedGrid::add_slice(SliceSamples slice) {
  const std::vector<MarkJob> tiles = schedule_.add_slice(std::move(slice)).tiles;
  std::vector<MarkedTile> marked(tiles.size());
  oneapi::tbb::parallel_for(std::size_t{0}, tiles.size(),
                            [&](std::size_t i) { marked[i] = mark(tiles[i], parameters_, schedule_); });
  for (MarkedTile& tile : marked) subdivide_all(schedule_.add_marks(std::move(tile)).bricks);
}

// A few bricks for each thread at a time: those of a layer may be many.
void DerivedGrid::subdivide_all(const std::vector<BrickJob>& jobs) {
  const auto together = static_cast<std::size_t>(4 * oneapi::tbb::this_task_arena::max_concurrency());
  for (std::size_t first = 0; first < jobs.size(); first += together) {
    std::vector<SubdividedBrick> bricks(std::min(together, jobs.size() - first));
    oneapi::tbb::parallel_for(std::size_t{0}, bricks.size(),
                              [&](std::size_t i) { bricks[i] = subdivide(jobs[first + i], parameters_); });
    for (const SubdividedBrick& brick : bricks) take_(brick);
  }
}

}  // namespace tagrid
