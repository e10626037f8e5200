#include "pipeline/mesh/mesh.h"

#include <fmt/format.h>

#include "io/files/errors.h"
#include "io/files/file_attributes.h"
#include "io/mesh/vtu_writer.h"
#include "pipeline/mesh/mesh_bricks.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

int checked_level(const MeshOptions& options, int cube_size) {
  const int deepest = max_level(cube_size);
  const int level = options.level.value_or(deepest);
  if (level < 0 || level > deepest)
    throw UsageError(Sentence{"{} must be from 0 to {}, because root cubes have an edge of {}",
                              {Setting{"level", "the level"}, deepest, cube_size}});
  return level;
}

void refuse_flat(const TagReader& reader, const MeshPart& part) {
  const Index3& n = reader.parameters().dims;
  if (!is_flat(reader.parameters(), part)) return;
  throw UsageError(
      fmt::format("{}: a volume of {} x {} x {} samples is one slice or less, so it fills no space",
                  reader.name(), n.x, n.y, n.z),
      Problem::mesh_fills_no_space);
}

}  // namespace

Finished<MeshResult> write_mesh(const MeshRun& run) {
  if (run.output != "-" && !run.output.ends_with(".vtu"))
    throw UsageError(run.output + ": a mesh is written as VTU; its name must end in .vtu");
  refuse_same_file(run.input, run.output);
  check_output(run.output, run.options.overwrite);
  TagReader reader(run.input);
  const CodingParameters& parameters = reader.parameters();
  const MeshPart part = {checked_level(run.options, parameters.cube_size), run.options.padded};
  refuse_flat(reader, part);
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
