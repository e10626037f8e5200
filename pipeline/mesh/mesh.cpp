#include "pipeline/mesh/mesh.h"

#include "io/files/errors.h"
#include "io/files/file_attributes.h"
#include "io/mesh/vtu_writer.h"
#include "pipeline/mesh/grid_bricks.h"
#include "pipeline/mesh/mesh_bricks.h"

namespace tagrid {

Finished<MeshResult> write_mesh(const MeshRun& run) {
  if (run.output != "-" && !run.output.ends_with(".vtu"))
    throw UsageError(run.output + ": a mesh is written as VTU; its name must end in .vtu");
  refuse_same_file(run.input, run.output);
  check_output(run.output, run.options.overwrite);
  TagReader reader(run.input);
  const CodingParameters& parameters = reader.parameters();
  const MeshPart part = {checked_level(run.options.level, parameters.cube_size), run.options.padded};
  if (!part.padded) refuse_flat(parameters, reader.name(), Problem::mesh_fills_no_space);
  // Checked before anything is written.
  plan_mesh(parameters, run.resources);
  const auto writer = std::make_shared<VtuWriter>(run.output, parameters.type, run.options.overwrite);
  mesh_all(reader, part, run.resources, *writer, run.progress);
  writer->finish();
  return {{reader.header(), reader.index(), reader.sizes().file, writer->file_bytes(), writer->point_count(),
           writer->tetrahedron_count()},
          writer};
}

}  // namespace tagrid
