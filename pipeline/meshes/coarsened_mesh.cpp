#include "pipeline/meshes/coarsened_mesh.h"

#include "pipeline/meshes/coarsen_file.h"

namespace tagrid {

void check_coarsened_mesh(const CodingParameters& parameters, std::uint64_t taker_bytes,
                          const Resources& resources) {
  plan_coarsening(parameters, taker_bytes, resources);
}

void take_coarsened(TagReader& reader, bool padded, double error, const std::string& path,
                    std::uint64_t taker_bytes, const Resources& resources, GridTaker& taker,
                    const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  const MeshBound bound{parameters.dims, parameters.cube_size, error, padded};
  const BrickGrid bricks = parameters.bricks();
  coarsen_file(
      reader, bound, Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)}), path, taker_bytes,
      resources,
      [&](Index3 position, const LatticeBits& active, const ValueOf& value_of) {
        taker.add_brick(position, active, value_of);
      },
      progress);
}

}  // namespace tagrid
