#include "pipeline/mesh/coarsened_mesh.h"

#include "io/nrrd/rescale.h"
#include "pipeline/coarsen/coarsen_file.h"

namespace tagrid {
namespace {

std::uint64_t bytes_of_coarse_builder(const CodingParameters& parameters, const MeshPart& part) {
  return MeshBuilder::working_bytes(parameters, bricks_of(part, parameters.bricks()));
}

}  // namespace

void check_coarsened_mesh(const CodingParameters& parameters, const MeshPart& part,
                          const Resources& resources) {
  plan_coarsening(parameters, bytes_of_coarse_builder(parameters, part), resources);
}

void mesh_coarsened(TagReader& reader, const MeshPart& part, double error, const std::string& path,
                    const Resources& resources, MeshSink& sink, const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  const MeshBound bound{parameters.dims, parameters.cube_size,
                        error_in_samples(error, rescale_of(reader.header().nrrd_fields)), part.padded};
  MeshBuilder mesh(reader.header(), part, sink);
  coarsen_file(
      reader, bound, bricks_of(part, parameters.bricks()), path, bytes_of_coarse_builder(parameters, part),
      resources,
      [&](Index3 position, const LatticeBits& active, const ValueOf& value_of) {
        mesh.add_brick(position, active, value_of);
      },
      progress);
}

}  // namespace tagrid
