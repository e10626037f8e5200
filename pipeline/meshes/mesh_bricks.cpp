#include "pipeline/meshes/mesh_bricks.h"

#include "pipeline/meshes/grid_bricks.h"

namespace tagrid {
namespace {

std::uint64_t bytes_of_builder(const CodingParameters& parameters, const MeshPart& part) {
  return MeshBuilder::working_bytes(parameters, bricks_that_meet(part.box, parameters.bricks()));
}

}  // namespace

DecodePlan plan_mesh(const CodingParameters& parameters, const Resources& resources) {
  return plan_taking(parameters, bytes_of_builder(parameters, {}), resources);
}

void mesh_all(TagReader& reader, const MeshPart& part, const Resources& resources, MeshSink& sink,
              const Progress& progress) {
  MeshBuilder mesh(reader.header(), bricks_that_meet(part.box, reader.parameters().bricks()), part, sink);
  take_all(reader, bytes_of_builder(reader.parameters(), part), resources, mesh, progress);
}

std::uint64_t memory_of_mesh_box(const CodingParameters& parameters, const MeshPart& part, int threads) {
  return memory_of_taking(parameters, bricks_that_meet(part.box, parameters.bricks()),
                          bytes_of_builder(parameters, part), threads);
}

void mesh_box(const TagBricks& file, const MeshPart& part, const Resources& resources, MeshSink& sink,
              const Progress& progress) {
  const CodingParameters& parameters = file.parameters();
  const Box positions = bricks_that_meet(part.box, parameters.bricks());
  MeshBuilder mesh(file.header(), positions, part, sink);
  take_some(file, positions, bytes_of_builder(parameters, part), resources, mesh, progress);
}

}  // namespace tagrid
