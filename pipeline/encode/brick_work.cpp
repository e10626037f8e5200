#include "pipeline/encode/brick_work.h"

#include <utility>

#include "stages/mesh/mesh_error.h"

namespace tagrid {

EncodedBrick encode(SubdividedBrick brick, const CodingParameters& parameters) {
  EncodedBrick encoded{parameters.bricks().id(brick.brick), std::make_shared<BrickCode>(), {}};
  const BrickSamples samples =
      gather(brick.slices, parameters.dims, parameters.type, samples_to_encode(parameters, brick.brick));
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
  const BrickSamples original = gather(brick.slices, parameters.dims, parameters.type, brick.active.box());
  encoded.code->statistics.mesh_error =
      measure_mesh(original, encoded.mesh->values, brick.active, parameters, brick.brick);
  encoded.mesh.reset();
}

}  // namespace tagrid
