#include "pipeline/meshes/mesh.h"

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/formats/nrrd/rescale.h"
#include "io/meshes/mesh_formats.h"
#include "pipeline/decode/values.h"
#include "pipeline/memory/of_writer.h"
#include "pipeline/meshes/coarsened_mesh.h"
#include "pipeline/meshes/grid_input.h"
#include "pipeline/meshes/mesh_builder.h"
#include "pipeline/meshes/notes.h"
#include "pipeline/reading/decode_region.h"

namespace tagrid {
namespace {

void check_coarsening(const MeshOptions& options) {
  constexpr Setting coarsen = {"coarsen", "the largest error of the mesh"};
  if (!options.coarsen) return;
  require(*options.coarsen >= 0, {"{} {} must be at least 0", {coarsen, *options.coarsen}});
  require(!options.level, {"{} determines how fine the grid is; it cannot be combined with {}",
                           {coarsen, Setting{"level", "a level"}}});
}

double error_of_samples(const MeshOptions& options, const TagHeader& header) {
  if (options.of_samples) return *options.coarsen;
  return error_in_samples(*options.coarsen, {largest_slope(header.nrrd_fields), 0});
}

}  // namespace

Finished<MeshResult> write_mesh(const MeshRun& run) {
  const MeshOptions& options = run.options;
  const MeshFormat& format = mesh_format_of(run.output);
  check_coarsening(options);
  refuse_same_file(run.input, run.output);
  check_output(run.output, options.overwrite);
  // How coarse a mesh may be in a region depends on the whole volume.
  GridInput input(run.input, !options.region.is_all() && !options.coarsen);
  if (options.coarsen && !options.of_samples)
    require_scale(input.header().nrrd_fields, {"coarsen", "the error of a mesh"});
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
      check_coarsened_mesh(parameters, bytes, run.resources);
    else
      input.check_memory(positions, bytes, run.resources);
  } catch (const MemoryLimit& limit) {
    if (format.memory_of_writer == 0) throw;
    throw_for_writer(limit, {format.writer}, format.memory_of_writer);
  }

  const std::shared_ptr<MeshFile> file = format.create(run.output, parameters.type, options.overwrite);
  file->set_notes(notes_of(input.header()));
  MeshBuilder builder(input.header(), positions, part, *file);
  if (options.coarsen)
    take_coarsened(input.stream(), part.padded, error_of_samples(options, input.header()), run.output, bytes,
                   run.resources, builder, run.progress);
  else
    input.pass_to(builder, positions, bytes, run.resources, run.progress);
  file->finish();
  return {{input.header(), input.index(), input.bytes(), file->file_bytes(), file->point_count(),
           file->tetrahedron_count(), file->warnings()},
          file};
}

}  // namespace tagrid
