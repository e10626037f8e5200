#include "pipeline/library/calls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/formats/nrrd/geometry.h"
#include "stages/grid/lattice.h"
#include "stages/sample/statistics.h"

namespace tagrid::library {
namespace {

double nan_unless(bool known, double value) { return known ? value : NAN; }

void copy(const Index3& from, std::int64_t* to) {
  for (int axis = 0; axis < 3; ++axis) to[axis] = from[axis];
}

}  // namespace

tagrid_geometry geometry_of_volume(const Geometry& geometry) {
  tagrid_geometry result = {};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    result.spacing[axis] = geometry.spacing[axis];
    result.origin[axis] = geometry.origin[axis];
    if (geometry.has_directions)
      std::copy(geometry.directions[axis].begin(), geometry.directions[axis].end(), result.directions[axis]);
    else
      result.directions[axis][axis] = spacing_or_1(geometry, axis);
  }
  result.has_spacing = geometry.has_spacing;
  result.has_origin = geometry.has_origin;
  result.has_directions = geometry.has_directions;
  return result;
}

std::string nrrd_fields_of(const tagrid_geometry& geometry) {
  const auto vector = [](const double* v) { return fmt::format("({},{},{})", v[0], v[1], v[2]); };
  if (!geometry.has_directions && !geometry.has_origin)
    return geometry.has_spacing
               ? spacings_line({geometry.spacing[0], geometry.spacing[1], geometry.spacing[2]})
               : "";
  const std::string origin =
      geometry.has_origin ? "space origin: " + vector(geometry.origin) + "\n" : std::string();
  bool is_known = geometry.has_spacing;
  for (const double spacing : geometry.spacing) is_known &= !std::isnan(spacing);
  // Directions would state a distance between samples, but it is unknown.
  if (!geometry.has_directions && !is_known) {
    const auto& s = geometry.spacing;
    return (geometry.has_spacing ? spacings_line({s[0], s[1], s[2]}) : "") + "space dimension: 3\n" + origin;
  }
  std::string lines = "space dimension: 3\nspace directions:";
  for (int axis = 0; axis < 3; ++axis) {
    double along_axis[3] = {0, 0, 0};
    along_axis[axis] = geometry.spacing[axis];
    lines += fmt::format(" {}", vector(geometry.has_directions ? geometry.directions[axis] : along_axis));
  }
  return lines + "\n" + origin;
}

tagrid_info info_of(const TagHeader& header, const TagIndex& index, const TagSizes& sizes) {
  const CodingParameters& p = header.parameters;
  const Statistics& total = index.total;
  const BrickGrid bricks = p.bricks();
  tagrid_info info = {};
  const VolumeInfo volume = volume_info_of(header);
  copy(volume.dims, info.dims);
  info.type = static_cast<tagrid_type>(volume.type);
  info.geometry = geometry_of_volume(volume.geometry);
  info.grid_only = p.mode == FileMode::grid;
  info.grid_derived = !p.counts_points();
  info.max_error = nan_unless(p.max_error >= 0, p.max_error);
  info.surface_error = nan_unless(p.surface_error >= 0, p.surface_error);
  info.mesh_error = nan_unless(p.mesh_error >= 0, p.mesh_error);
  info.cube = p.cube_size;
  info.levels = max_level(p.cube_size);
  info.accuracy = p.accuracy;
  info.field_scale = p.field_scale;
  info.range[0] = nan_unless(p.range_low < p.range_high, p.range_low);
  info.range[1] = nan_unless(p.range_low < p.range_high, p.range_high);
  const Achieved achieved = achieved_of(total);
  info.achieved_max_error = achieved.max_error;
  info.achieved_rmse = achieved.rmse;
  info.achieved_psnr = achieved.max_error == 0 ? INFINITY : achieved.psnr;
  info.achieved_mesh_error = nan_unless(total.mesh_error >= 0, total.mesh_error);
  info.low = total.low;
  info.high = total.high;
  info.mean = total.finite > 0 ? total.sum / static_cast<double>(total.finite) : NAN;
  info.file_bytes = sizes.file;
  info.header_bytes = sizes.header;
  info.activity_bytes = sizes.activity;
  info.value_bytes = sizes.values;
  info.index_bytes = sizes.index;
  for (int axis = 0; axis < 3; ++axis) info.bricks[axis] = bricks.bricks(axis);
  info.brick_edge = p.bricks().length();
  info.lead = p.lead;
  for (const std::uint64_t points : total.active) info.active_points += points;
  return info;
}

}  // namespace tagrid::library
