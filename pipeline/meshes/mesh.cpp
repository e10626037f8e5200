#include "pipeline/meshes/mesh.h"

#include "io/errors/errors.h"
#include "io/meshes/formats.h"
#include "io/metadata/rescale.h"
#include "pipeline/decode/values.h"
#include "pipeline/memory/resources.h"
#include "pipeline/meshes/coarsened_grid.h"
#include "pipeline/meshes/mesh_builder.h"
#include "pipeline/reading/read_region.h"

namespace tagrid {
namespace {

void check_coarsening(const MeshOptions& options) {
  constexpr Setting coarsen = {"coarsen", "the largest error of the mesh"};
  if (!options.coarsen) return;
  require(*options.coarsen >= 0, {"{} {} must be at least 0", coarsen, *options.coarsen});
  require(!options.level, {"{} determines how fine the grid is; it cannot be combined with {}", coarsen,
                           Setting{"level", "a level"}});
}

double error_of_samples(const MeshOptions& options, const TagHeader& header) {
  if (options.of_samples) return *options.coarsen;
  return error_in_samples(*options.coarsen, {header.metadata.largest_slope(), 0});
}

}  // namespace

Finished<MeshResult> write_mesh(const MeshRun& run) {
  const MeshOptions& options = run.options;
  const MeshFormat& format = mesh_format_of(run.output);
  check_coarsening(options);
  // How coarse a mesh may be in a region depends on the whole volume.
  GridInput input(run.input, run.volume, !options.region.is_all() && !options.coarsen, run.output,
                  options.overwrite);
  if (options.coarsen && !options.of_samples)
    require_scale(input.header().metadata, {"coarsen", "the error of a mesh"});
  const CodingParameters& parameters = input.header().parameters;
  MeshPart part = {checked_level(options.level, parameters.cube_size), options.padded};
  if (!options.region.is_all()) part.box = region_of(options.region, parameters).box;
  if (!part.padded) refuse_flat(parameters, input.name(), Problem::mesh_fills_no_space);
  const Box positions = input.positions(part.box);
  // What a program takes in the end counts, too: freed memory may stay with the process.
  const std::uint64_t bytes = MeshBuilder::working_bytes(parameters, positions) + format.memory_of_writer;
  // Checked before anything is written.
  try {
    if (options.coarsen)
      plan_coarsening(parameters, bytes, run.resources);
    else
      input.check_memory(positions, bytes, run.resources);
  } catch (const MemoryLimit& limit) {
    if (format.memory_of_writer == 0) throw;
    throw_for_writer(limit, {format.writer}, format.memory_of_writer);
  }

  const std::shared_ptr<MeshFile> file = format.create(run.output, parameters.type, options.overwrite);
  file->set_notes(input.notes());
  MeshBuilder builder(input.header(), positions, part, *file);
  if (options.coarsen) {
    const MeshBound bound{parameters.domain().volume(), parameters.cube_size,
                          error_of_samples(options, input.header()), part.padded};
    const auto add_brick = [&](Index3 position, const LatticeBits& active, const ValueOf& value_of) {
      builder.add_brick(position, active, value_of);
    };
    coarsen_file(input.stream(), bound, positions, run.output, bytes, run.resources, add_brick, run.progress);
  } else {
    input.pass_to(builder, positions, bytes, run.resources, run.progress);
  }
  file->finish();
  return {{input.result_in(*file), file->point_count(), file->tetrahedron_count()}, file};
}

}  // namespace tagrid
