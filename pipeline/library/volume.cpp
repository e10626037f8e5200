#include "pipeline/library/answers.h"

#include <algorithm>
#include <cmath>

#include "stages/grid/lattice.h"
#include "stages/sample/statistics.h"

namespace tagrid::library {
namespace {

double nan_unless(bool known, double value) { return known ? value : NAN; }

void copy(const Index3& from, std::int64_t* to) {
  for (int axis = 0; axis < 3; ++axis) to[axis] = from[axis];
}

}  // namespace

tagrid_status status_of(const SortedError& error) {
  if (error.detail.problem == Problem::memory_limit) return TAGRID_MEMORY_LIMIT;
  if (error.detail.problem == Problem::cancelled) return TAGRID_CANCELLED;
  if (error.detail.problem == Problem::newer_format) return TAGRID_NEWER_FORMAT;
  switch (error.kind) {
    case ErrorKind::usage:
      return TAGRID_INVALID_ARGUMENT;
    case ErrorKind::broken_input:
      return TAGRID_BROKEN_INPUT;
    case ErrorKind::closed_pipe:
    case ErrorKind::world:
      return TAGRID_IO_ERROR;
    case ErrorKind::memory:
      return TAGRID_OUT_OF_MEMORY;
    case ErrorKind::bug:
      break;
  }
  return TAGRID_BUG;
}

Box box_of(const tagrid_box& given, const Index3& dims) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = given.low[axis];
    box.high[axis] = given.high[axis] - 1;
    require(given.low[axis] >= 0 && given.low[axis] < given.high[axis] && given.high[axis] <= dims[axis],
            "the box is empty, or not within the volume");
  }
  return box;
}

tagrid_box half_open(const Box& box) {
  tagrid_box result;
  copy(box.low, result.low);
  copy(box.high + Index3{1, 1, 1}, result.high);
  return result;
}

Strides strides_of(const std::int64_t* strides, const Index3& shape, std::size_t sample_size) {
  if (strides != nullptr) return {strides[0], strides[1], strides[2]};
  const auto size = static_cast<std::int64_t>(sample_size);
  return {size, size * shape.x, size * shape.x * shape.y};
}

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

tagrid_info info_of(const TagHeader& header, const TagIndex& index, const TagSizes& sizes) {
  const CodingParameters& p = header.parameters;
  const Statistics& total = index.total;
  const BrickGrid bricks = p.bricks();
  tagrid_info info = {};
  const VolumeInfo volume = volume_info_of(header);
  copy(volume.dims, info.dims);
  info.type = static_cast<tagrid_type>(volume.type);
  info.geometry = geometry_of_volume(volume.geometry());
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
  static_assert(TAGRID_MOST_THRESHOLDS == most_thresholds);
  info.threshold_count = static_cast<int>(p.thresholds.count);
  for (std::size_t i = 0; i < p.thresholds.count; ++i) {
    info.thresholds[i] = p.thresholds.all[i];
    info.samples_at_least[i] = total.at_least.all[i];
    info.samples_moved[i] = total.moved.all[i];
  }
  info.file_bytes = sizes.file;
  info.header_bytes = sizes.header;
  info.activity_bytes = sizes.activity;
  info.value_bytes = sizes.values;
  info.index_bytes = sizes.index;
  for (int axis = 0; axis < 3; ++axis) info.bricks[axis] = bricks.bricks(axis);
  info.brick_edge = p.bricks().length();
  info.lead = p.lead;
  info.unknown_parts = static_cast<int>(index.unknown_sections.size()) +
                       static_cast<int>(std::count_if(index.members.begin(), index.members.end(),
                                                      [](const Member& m) { return m.is_unknown(); }));
  for (const std::uint64_t points : total.active) info.active_points += points;
  return info;
}

void list_overviews(const TagIndex& index, std::int64_t* factors) {
  require(factors != nullptr, "there is no room for the factors");
  static_assert(TAGRID_MOST_OVERVIEWS == most_members);
  std::fill_n(factors, TAGRID_MOST_OVERVIEWS, 0);
  for (const Member& member : index.members)
    if (member.is_overview()) *factors++ = member.factor;
}

}  // namespace tagrid::library
