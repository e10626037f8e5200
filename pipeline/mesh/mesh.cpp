#include "pipeline/mesh/mesh.h"

#include "io/files/errors.h"
#include "io/files/file_attributes.h"
#include "io/mesh/vtu_writer.h"
#include "pipeline/mesh/coarsened_mesh.h"
#include "pipeline/mesh/grid_bricks.h"
#include "pipeline/mesh/mesh_bricks.h"

namespace tagrid {
namespace {

void check_coarsening(const MeshOptions& options) {
  constexpr Setting coarsen = {"coarsen", "the largest error of the mesh"};
  if (!options.coarsen) return;
  if (!(*options.coarsen >= 0)) throw UsageError(Sentence{"{} must be at least 0", {coarsen}});
  if (options.level)
    throw UsageError(Sentence{"{} determines how fine the grid is; it cannot be combined with {}",
                              {coarsen, Setting{"level", "a level"}}});
}

}  // namespace

Finished<MeshResult> write_mesh(const MeshRun& run) {
  if (run.output != "-" && !run.output.ends_with(".vtu"))
    throw UsageError(run.output + ": a mesh is written as VTU; its name must end in .vtu");
  check_coarsening(run.options);
  refuse_same_file(run.input, run.output);
  check_output(run.output, run.options.overwrite);
  TagReader reader(run.input);
  const CodingParameters& parameters = reader.parameters();
  const MeshPart part = {checked_level(run.options.level, parameters.cube_size), run.options.padded};
  if (!part.padded) refuse_flat(parameters, reader.name(), Problem::mesh_fills_no_space);
  // Checked before anything is written.
  if (run.options.coarsen)
    check_coarsened_mesh(parameters, part, run.resources);
  else
    plan_mesh(parameters, run.resources);
  const auto writer = std::make_shared<VtuWriter>(run.output, parameters.type, run.options.overwrite);
  if (run.options.coarsen)
    mesh_coarsened(reader, part, *run.options.coarsen, run.output, run.resources, *writer, run.progress);
  else
    mesh_all(reader, part, run.resources, *writer, run.progress);
  writer->finish();
  return {{reader.header(), reader.index(), reader.sizes().file, writer->file_bytes(), writer->point_count(),
           writer->tetrahedron_count()},
          writer};
}

}  // namespace tagrid
