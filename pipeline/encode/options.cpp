#include "pipeline/encode/options.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <limits>

#include "io/files/errors.h"
#include "io/tag/header.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

void require(bool condition, const std::string& message) {
  if (!condition) throw UsageError(message);
}

void require_bound(const std::optional<double>& bound, const char* option) {
  require(!bound || (std::isfinite(*bound) && *bound >= 0),
          fmt::format("{} must be a number from 0", option));
}

// The field scale is this many voxels for the whole value range. It does not depend on S: with a scale in
// proportion to S the number of active points would depend on S.
constexpr double voxels_per_range = 8;

// Without a word from the caller files and pipes must give the same bytes, so the data is not asked.
std::pair<double, double> usual_range(SampleType type) {
  switch (type) {
    case SampleType::uint8:
      return {0, 256};
    case SampleType::int8:
      return {-128, 128};
    case SampleType::uint16:
      return {0, 4096};
    case SampleType::int16:
      return {-1024, 3072};
    default:
      throw UsageError(
          fmt::format("a pipe of {} samples needs --range lo:hi or --field-scale: what matters in it cannot "
                      "be known before it was read",
                      name_of(type)));
  }
}

void set_field_scale(const EncodeOptions& options, std::optional<std::pair<double, double>> range_of_data,
                     CodingParameters& p) {
  if (options.field_scale) {
    p.field_scale = *options.field_scale;
    return;
  }
  const auto [low, high] = options.range   ? *options.range
                           : range_of_data ? *range_of_data
                                           : usual_range(p.type);
  p.range_low = low;
  p.range_high = high;
  p.field_scale = voxels_per_range / (high - low);
  // Ranges of floats may be too wide for their width to be a number, or too narrow for its reciprocal.
  if (!std::isfinite(high - low)) p.field_scale = 1 / (high / voxels_per_range - low / voxels_per_range);
  if (!std::isfinite(p.field_scale)) p.field_scale = high > low ? std::numeric_limits<double>::max() : 1;
}

// The mesh has the values of active voxels, and is as far off as they are.
void require_mesh_of_voxels(const CodingParameters& p) {
  const bool two_bounds = p.surface_error >= 0;
  const double of_values = two_bounds ? p.surface_error : p.max_error;
  if (p.mesh_error < 0 || p.mesh_error >= of_values) return;
  const char* option = two_bounds ? "--surface-error" : "--max-error";
  throw UsageError(fmt::format(
      "--mesh-error {0} cannot be kept with {1} {2}: the mesh has values that are up to {2} off; give "
      "--mesh-error {2} or more, or {1} {0} or less{3}",
      p.mesh_error, option, of_values,
      two_bounds ? "" : fmt::format(", or --surface-error {} besides", p.mesh_error)));
}

void set_bounds(const EncodeOptions& options, CodingParameters& p) {
  // Where samples are integers, so are errors.
  const bool real = is_float_type(p.type);
  const auto whole = [real](const std::optional<double>& e) {
    return !e ? -1.0 : real ? *e : std::floor(*e);
  };
  p.mesh_error = whole(options.mesh_error);
  if (p.mode == FileMode::voxels) {
    p.max_error = std::max(whole(options.max_error), 0.0);
    p.surface_error = whole(options.surface_error);
    require(p.surface_error < p.max_error || p.surface_error < 0,
            "--surface-error must be below --max-error, both rounded down to whole units");
    require_mesh_of_voxels(p);
    return;
  }
  p.max_error = whole(options.max_error);
  if (p.max_error < 0) return;
  // The error of a voxel is at most E_m (interpolation) + E_n (stored points), and one rounding of a number
  // that is within E of an integer keeps it within E. Of floats the mesh criterion takes off what is rounded.
  const double tighter = p.mesh_error < 0 ? p.max_error : std::min(p.mesh_error, p.max_error);
  p.point_error = real ? tighter / 2 : std::floor(tighter / 2);
}

// What a reader would refuse is not written in the first place.
void require_valid(const CodingParameters& p, const std::string& volume) {
  const Status status = check_parameters(p);
  require(status.ok(), fmt::format("{} cannot be encoded so: {}", volume, status.what()));
}

}  // namespace

void EncodeOptions::validate() const {
  require_bound(max_error, "--max-error");
  require_bound(surface_error, "--surface-error");
  require_bound(mesh_error, "--mesh-error");
  require(!surface_error || !grid_only, "--surface-error binds voxels; it does not go with --grid-only");
  require(!surface_error || max_error, "--surface-error needs --max-error, which binds the other voxels");
  require(!surface_error || *surface_error < *max_error, "--surface-error must be below --max-error");
  require(accuracy >= 3 && accuracy <= max_accuracy, "--accuracy must be a whole number, 3 .. 1000000");
  require(cube_size >= min_cube_size && cube_size <= max_cube_size &&
              std::has_single_bit(static_cast<unsigned>(cube_size)),
          "--cube must be a power of two, 4 .. 256");
  require(
      !max_level || (*max_level >= 0 && *max_level <= tagrid::max_level(cube_size)),
      fmt::format("--max-level must be 0 .. {} for cubes of {}", tagrid::max_level(cube_size), cube_size));
  const bool limited = max_level && *max_level < tagrid::max_level(cube_size);
  require(!limited || !grid_only || !max_error,
          "a grid with --max-level keeps no bound: leave out --max-error");
  require(!limited || !mesh_error, "a grid with --max-level keeps no bound: leave out --mesh-error");
  require(!brick_edge || (*brick_edge >= 1 && *brick_edge <= 512 / cube_size),
          "--brick must be at least 1 root cube and at most 512 samples an edge");
  require(!field_scale || (std::isfinite(*field_scale) && *field_scale > 0),
          "--field-scale must be positive");
  require(!field_scale || (!range && !range_from_data),
          "--field-scale and --range say the same thing: give one");
  require(
      !range || (std::isfinite(range->first) && std::isfinite(range->second) && range->first < range->second),
      "--range must be lo:hi with lo < hi");
}

CodingParameters parameters_but_scale(const EncodeOptions& options, const VolumeInfo& info) {
  options.validate();
  CodingParameters p;
  p.dims = info.dims;
  p.type = info.type;
  p.mode = options.grid_only ? FileMode::grid : FileMode::voxels;
  p.effort = options.effort;
  p.cube_size = options.cube_size;
  p.brick_edge = options.brick_edge.value_or(std::max(2, 64 / options.cube_size));
  p.max_level = options.max_level.value_or(max_level(options.cube_size));
  p.accuracy = options.accuracy;
  set_bounds(options, p);
  return p;
}

CodingParameters resolve(const EncodeOptions& options, const VolumeInfo& info, const std::string& name,
                         std::optional<std::pair<double, double>> range_of_data) {
  CodingParameters p = parameters_but_scale(options, info);
  set_field_scale(options, range_of_data, p);
  require_valid(p, name);
  return p;
}

}  // namespace tagrid
