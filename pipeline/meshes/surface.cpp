#include "pipeline/meshes/surface.h"

#include <memory>

#include "io/meshes/formats.h"
#include "pipeline/reading/read_region.h"

namespace tagrid {

Finished<SurfaceResult> write_surface(const SurfaceRun& run) {
  const SurfaceOptions& options = run.options;
  const MeshFormat& format = surface_format_of(run.output);
  GridInput input(run.input, run.volume, !options.region.is_all(), run.output, options.overwrite);
  const CodingParameters& parameters = input.header().parameters;
  SurfacePart part{checked_level(options.level, parameters.cube_size), std::nullopt, options.close,
                   options.area};
  if (!options.region.is_all()) part.box = region_of(options.region, parameters).box;
  refuse_flat(parameters, input.name(), Problem::none);
  const SurfaceLevel level = options.of_samples ? SurfaceLevel{options.iso, false}
                                                : surface_level(options.iso, input.header(), input.name());
  const Box positions = input.positions(part.box);
  const std::uint64_t builder_bytes = SurfaceBuilder::working_bytes(parameters, positions);
  // Checked before anything is written.
  input.check_memory(positions, builder_bytes, run.resources);

  const std::shared_ptr<SurfaceFile> file = format.create_surface(run.output, options.overwrite);
  file->set_notes(input.notes());
  SurfaceBuilder builder(input.header(), positions, part, level, *file);
  input.pass_to(builder, positions, builder_bytes, run.resources, run.progress);
  file->finish();
  SurfaceResult result{input.result_in(*file), builder.counts(), {}};
  if (!part.box && !result.counts.has_gaps) result.boundary_edges = result.counts.border_edges;
  return {std::move(result), file};
}

}  // namespace tagrid
