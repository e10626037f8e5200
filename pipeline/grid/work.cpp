#include "pipeline/grid/work.h"

#include <memory>
#include <utility>

#include "stages/criterion/subdivide.h"
#include "stages/criterion/tile.h"

namespace tagrid {

MarkedTile mark(const MarkJob& job, const CodingParameters& parameters, const GridSchedule& schedule) {
  const Box cubes = schedule.tile_box(job.tile);
  const BrickSamples samples =
      gather(job.slices, parameters.dims, parameters.type, cubes.grown(mark_halo(parameters)));
  return {job.tile,
          std::make_shared<LatticeBits>(mark_tile(samples, cubes, schedule.mark_box(job.tile), parameters))};
}

SubdividedBrick subdivide(const BrickJob& job, const CodingParameters& parameters) {
  if (job.marks.empty()) return {job.brick, job.slices, {}};
  const Domain domain = parameters.domain();
  const Box box = parameters.bricks().closed_box(job.brick);
  LatticeBits marks(region_of_marks(box, domain));
  for (const auto& tile : job.marks) copy_bits(*tile, marks);
  return {job.brick, job.slices, subdivide(std::move(marks), box, domain)};
}

}  // namespace tagrid
