#include "pipeline/encode/brick_work.h"

#include <utility>

#include "stages/marks/halo.h"
#include "stages/marks/subdivide.h"

namespace tagrid {
namespace {

BrickSamples gathered(const SliceRange& slices, const CodingParameters& parameters, const Box& box) {
  return {box, gather(slices, parameters.dims, size_of(parameters.type), box)};
}

}  // namespace

MarkedTile mark(const MarkJob& job, const CodingParameters& parameters, const EncodeSchedule& schedule) {
  const Box cubes = schedule.tile_box(job.tile);
  const BrickSamples samples = gathered(job.slices, parameters, cubes.grown(mark_halo(parameters)));
  return {job.tile,
          std::make_shared<LatticeBits>(mark_tile(samples, cubes, schedule.mark_box(job.tile), parameters))};
}

SubdividedBrick subdivide(const BrickJob& job, const CodingParameters& parameters) {
  const Domain domain = parameters.domain();
  const Box box = parameters.bricks().closed_box(job.brick);
  LatticeBits marks(region_of_marks(box, domain));
  for (const auto& tile : job.marks) copy_bits(*tile, marks);
  return {job.brick, job.slices, subdivide(std::move(marks), box, domain)};
}

EncodedBrick encode(SubdividedBrick brick, const CodingParameters& parameters) {
  EncodedBrick encoded{parameters.bricks().id(brick.brick), std::make_shared<BrickCode>(), {}};
  const BrickSamples samples = gathered(brick.slices, parameters, samples_to_encode(parameters, brick.brick));
  encode_brick(samples, brick.active, parameters, brick.brick, *encoded.code);
  if (parameters.mesh_error >= 0)
    encoded.mesh = std::make_shared<MeshedBrick>(MeshedBrick{std::move(brick), {}});
  return encoded;
}

void take_mesh_values(EncodedBrick& encoded, const CodingParameters& parameters, ClosedSamples* closed) {
  if (closed)
    encoded.mesh->values = closed->complete(encoded.mesh->of.brick, encoded.code->decoded);
  else if (parameters.mode == FileMode::grid)
    encoded.mesh->values = std::move(encoded.code->decoded);
  encoded.code->decoded = {};
}

void measure_mesh(EncodedBrick& encoded, const CodingParameters& parameters) {
  const SubdividedBrick& brick = encoded.mesh->of;
  const BrickSamples original = gathered(brick.slices, parameters, brick.active.box());
  encoded.code->statistics.mesh_error =
      measure_mesh(original, encoded.mesh->values, brick.active, parameters, brick.brick);
  encoded.mesh.reset();
}

}  // namespace tagrid
