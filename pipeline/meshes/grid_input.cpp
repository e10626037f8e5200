#include "pipeline/meshes/grid_input.h"

#include <algorithm>
#include <cmath>

#include "io/files/file_attributes.h"
#include "io/files/open_source.h"
#include "io/files/output_file.h"
#include "io/metadata/foreign_geometry.h"
#include "io/metadata/lengths.h"

namespace tagrid {
namespace {

double smallest_spacing(const Geometry& geometry) {
  double smallest = INFINITY;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& d = geometry.directions[axis];
    const double distance = geometry.has_directions ? std::hypot(d[0], d[1], d[2]) : geometry.spacing[axis];
    smallest = std::min(smallest, std::isnan(distance) ? 1 : std::abs(distance));
  }
  return smallest;
}

}  // namespace

GridInput::GridInput(const std::string& path, std::int64_t volume, bool is_part, const std::string& output,
                     bool overwrite) {
  refuse_same_file(path, output);
  check_output(output, overwrite);
  if (is_part && is_regular_input(path))
    bricks_ = std::make_unique<TagBricks>(volume_in(open_source(path), volume));
  else if (volume != 0)
    stream_ =
        std::make_unique<TagReader>(std::make_unique<SourceStream>(volume_in(open_source(path), volume)));
  else
    stream_ = std::make_unique<TagReader>(path);
}

MeshNotes GridInput::notes() const {
  const Geometry geometry = in_one_unit(header().metadata.geometry());
  return {short_name_of_space(geometry.space), header().metadata.rescale(), smallest_spacing(geometry)};
}

Box GridInput::positions(const std::optional<Box>& box) const {
  return bricks_that_meet(bricks_ ? box : std::nullopt, header().parameters.bricks());
}

void GridInput::check_memory(const Box& positions, std::uint64_t taker_bytes,
                             const Resources& resources) const {
  const CodingParameters& parameters = header().parameters;
  if (bricks_)
    threads_for_taking(parameters, positions, taker_bytes, resources);
  else
    plan_taking(parameters, taker_bytes, resources);
}

void GridInput::pass_to(GridTaker& taker, const Box& positions, std::uint64_t taker_bytes,
                        const Resources& resources, const Progress& progress) {
  if (bricks_)
    take_some(*bricks_, positions, taker_bytes, resources, taker, progress);
  else
    take_all(*stream_, taker_bytes, resources, taker, progress);
}

}  // namespace tagrid
