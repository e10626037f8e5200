#include "pipeline/meshes/surface_bricks.h"

#include <fmt/format.h>

#include <cmath>

#include "io/errors/errors.h"
#include "io/formats/nrrd/geometry.h"
#include "io/formats/nrrd/rescale.h"
#include "io/text/text.h"
#include "pipeline/decode/values.h"
#include "pipeline/meshes/grid_bricks.h"

namespace tagrid {
namespace {

std::uint64_t bytes_of_surface(const CodingParameters& parameters, const SurfacePart& part) {
  return SurfaceBuilder::working_bytes(parameters, bricks_that_meet(part.box, parameters.bricks()));
}

}  // namespace

SurfaceLevel surface_level(double iso, const TagHeader& header, const std::string& name) {
  if (has_slopes_of_slices(header.nrrd_fields))
    throw UsageError(fmt::format(
        "{}: each slice has its own slope (slice_slopes), so a value is a different sample in each", name));
  require_scale(header.nrrd_fields, {"iso", "the level of a surface"});
  for (const auto& [key, value] : key_values_of(header.nrrd_fields))
    if (key == "rescale_slope" && number_of(value).value_or(0) == 0)
      throw BrokenInput(fmt::format("{}: the header: rescale_slope is {}, which is not a slope", name,
                                    quoted(std::string_view(value))));
  const Rescale rescale = rescale_of(header.nrrd_fields);
  const SurfaceLevel level{(iso - rescale.intercept) / rescale.slope, rescale.slope < 0};
  if (!std::isfinite(level.value))
    throw UsageError(fmt::format("{}: the value {} has no finite sample with the slope {} of this file", name,
                                 iso, rescale.slope));
  return level;
}

SurfaceCounts surface_of_all(TagReader& reader, const SurfacePart& part, const SurfaceLevel& level,
                             const Resources& resources, SurfaceSink& sink, const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  SurfaceBuilder builder(reader.header(), bricks_that_meet(part.box, parameters.bricks()), part, level, sink);
  take_all(reader, bytes_of_surface(parameters, part), resources, builder, progress);
  return builder.counts();
}

SurfaceCounts surface_of_box(const TagBricks& file, const SurfacePart& part, const SurfaceLevel& level,
                             const Resources& resources, SurfaceSink& sink, const Progress& progress) {
  const CodingParameters& parameters = file.parameters();
  const Box positions = bricks_that_meet(part.box, parameters.bricks());
  SurfaceBuilder builder(file.header(), positions, part, level, sink);
  take_some(file, positions, bytes_of_surface(parameters, part), resources, builder, progress);
  return builder.counts();
}

}  // namespace tagrid
