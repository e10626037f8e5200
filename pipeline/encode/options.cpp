#include "pipeline/encode/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "io/files/errors.h"
#include "io/nrrd/geometry.h"
#include "io/nrrd/rescale.h"
#include "io/tag/header.h"
#include "stages/grid/lattice.h"
#include "stages/volume/bound.h"

namespace tagrid {
namespace {

void require(bool condition, const Sentence& otherwise) {
  if (!condition) throw UsageError(otherwise);
}

void require_bound(const std::optional<double>& bound, const Setting& setting) {
  require(!bound || is_bound(*bound),
          {"{} {} must be a finite number of at least 0", {setting, bound.value_or(0)}});
}

// The field scale is this many voxels for the whole value range. It does not depend on S: with a scale
// proportional to S, the number of active points would depend on S.
constexpr double voxels_per_range = 8;

// The default does not depend on the data, so that files and pipes give the same bytes.
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
      throw UsageError(Sentence{
          "a pipe of {} samples needs {} lo:hi or {}: its range is not known before it has been read",
          {name_of(type), setting::range, setting::field_scale}});
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
  // Ranges of floats may be so wide that their width is not a number, or so narrow that its reciprocal is
  // not.
  if (!std::isfinite(high - low)) p.field_scale = 1 / (high / voxels_per_range - low / voxels_per_range);
  if (!std::isfinite(p.field_scale)) p.field_scale = high > low ? std::numeric_limits<double>::max() : 1;
}

// The mesh has the values of active voxels, and so their errors.
void require_mesh_of_voxels(const CodingParameters& p) {
  const bool two_bounds = p.surface_error >= 0;
  const double of_values = two_bounds ? p.surface_error : p.max_error;
  if (p.mesh_error < 0 || p.mesh_error >= of_values) return;
  const Setting& bound = two_bounds ? setting::surface_error : setting::max_error;
  Sentence refusal{
      "{0} {1} cannot be kept with {2} {3}: the values of the mesh are off by up to {3}; give {0} {3} or "
      "more, or {2} {1} or less",
      {setting::mesh_error, p.mesh_error, bound, of_values}};
  if (!two_bounds) {
    refusal.text += ", or add {4} {1}";
    refusal.terms.push_back(setting::surface_error);
  }
  throw UsageError(refusal);
}

void set_bounds(const EncodeOptions& options, CodingParameters& p) {
  // If samples are integers, so are errors.
  const bool real = is_float_type(p.type);
  const auto whole = [real](const std::optional<double>& e) {
    return !e ? -1.0 : real ? *e : std::floor(*e);
  };
  // Until the rule has given a bound, any that is not 0 stands for it.
  const std::optional<double> max_error =
      options.error_rule ? 2 * options.surface_error.value_or(0) + 1 : options.max_error;
  p.mesh_error = whole(options.mesh_error);
  if (p.mode == FileMode::voxels) {
    p.max_error = std::max(whole(max_error), 0.0);
    p.surface_error = whole(options.surface_error);
    require(p.surface_error < p.max_error || p.surface_error < 0,
            {"{} must be below {} after both are rounded down to whole units",
             {setting::surface_error, setting::max_error}});
    if (!options.error_rule) require_mesh_of_voxels(p);
    return;
  }
  p.max_error = whole(max_error);
  if (p.max_error < 0) return;
  // The error of a voxel is at most E_m (interpolation) + E_n (stored points). Rounding once keeps a number
  // within E of an integer if it was within E before. For floats, the mesh criterion subtracts the rounding
  // errors.
  const double tighter = p.mesh_error < 0 ? p.max_error : std::min(p.mesh_error, p.max_error);
  p.point_error = real ? tighter / 2 : std::floor(tighter / 2);
}

// Refuses to write a file that a reader would refuse.
void require_valid(const Status& status, const std::string& volume) {
  require(status.ok(), {"{} cannot be encoded: {}", {volume, status.what()}});
}

void validate_rule(const EncodeOptions& options) {
  namespace set = setting;
  using Kind = ErrorRule::Kind;
  const auto& [kind, value] = *options.error_rule;
  const Setting& own = kind == Kind::psnr       ? set::psnr
                       : kind == Kind::relative ? set::relative_error
                                                : set::max_error;
  require(std::isfinite(value) && value > 0, {"{} must be a positive number", {own}});
  require(!options.max_error,
          {"{} and {} both say how large errors may be; give only one", {set::max_error, own}});
  require(kind != Kind::psnr || !options.grid_only,
          {"{} is found by coding voxels; it cannot be combined with {}", {set::psnr, set::grid_only}});
  require(
      kind != Kind::psnr || !options.surface_error,
      {"{} gives one bound for all voxels; it cannot be combined with {}", {set::psnr, set::surface_error}});
}

// Rules follow from the samples, whatever they stand for.
bool bounds_values(const EncodeOptions& options) {
  return options.max_error.value_or(0) > 0 || options.surface_error.value_or(0) > 0 ||
         options.mesh_error.value_or(0) > 0;
}

}  // namespace

std::string text_of(const ErrorRule& rule) {
  using Kind = ErrorRule::Kind;
  return fmt::format("{} {}",
                     rule.kind == Kind::noise      ? "noise"
                     : rule.kind == Kind::relative ? "relative"
                                                   : "psnr",
                     rule.value);
}

void EncodeOptions::validate() const {
  namespace set = setting;
  require_bound(max_error, set::max_error);
  require_bound(surface_error, set::surface_error);
  require_bound(mesh_error, set::mesh_error);
  require(!surface_error || !grid_only,
          {"{} is a bound on voxels; it cannot be combined with {}", {set::surface_error, set::grid_only}});
  if (error_rule) validate_rule(*this);
  require(!surface_error || max_error || error_rule,
          {"{} needs {}, the bound on the other voxels", {set::surface_error, set::max_error}});
  require(!surface_error || !max_error || *surface_error < *max_error,
          {"{} must be below {}", {set::surface_error, set::max_error}});
  const auto needs_stored = [](const Setting& what) {
    return Sentence{"{} needs the grid in the file; it cannot be combined with {} derived",
                    {what, set::grid}};
  };
  const bool derived = grid == GridOrigin::derived;
  require(!derived || !grid_only, needs_stored(set::grid_only));
  require(!derived || !surface_error, needs_stored(set::surface_error));
  require(!derived || !mesh_error, needs_stored(set::mesh_error));
  require(accuracy >= 3 && accuracy <= max_accuracy,
          {"{} must be a whole number from 3 to 1000000", {set::accuracy}});
  require(cube_size >= min_cube_size && cube_size <= max_cube_size &&
              std::has_single_bit(static_cast<unsigned>(cube_size)),
          {"{} must be a power of two from 4 to 256", {set::cube}});
  const int deepest = tagrid::max_level(cube_size);
  require(!max_level || (*max_level >= 0 && *max_level <= deepest),
          {"{} must be from 0 to {}, because root cubes have an edge of {}",
           {set::max_level, deepest, cube_size}});
  const bool bounded = max_error || error_rule;
  const bool limited = max_level && *max_level < deepest;
  const auto no_bound = [](const Setting& bound) {
    return Sentence{"a grid that is limited by {} cannot keep a bound; leave out {}",
                    {set::max_level, bound}};
  };
  require(!limited || !grid_only || !bounded, no_bound(set::max_error));
  require(!limited || !mesh_error, no_bound(set::mesh_error));
  require(!brick_edge || (*brick_edge >= 1 && *brick_edge <= 512 / cube_size),
          {"{} must be at least 1, and the edge of a brick at most 512 samples", {set::brick}});
  require(!field_scale || (std::isfinite(*field_scale) && *field_scale > 0),
          {"{} must be positive", {set::field_scale}});
  require(!field_scale || (!range && !range_from_data),
          {"{} and {} have the same meaning; give only one", {set::field_scale, set::range}});
  require(
      !range || (std::isfinite(range->first) && std::isfinite(range->second) && range->first < range->second),
      {"{} must be lo:hi with lo < hi", {set::range}});
}

std::string kept_fields(const EncodeOptions& options, const VolumeInfo& info) {
  return options.strip ? stripped(info.nrrd_fields) : info.nrrd_fields;
}

OptionsForSamples for_samples(const EncodeOptions& options, const SourceFacts& source) {
  require(source.scale_doubt.empty() || !bounds_values(options),
          {"{}. So nobody knows which error in the samples the bound allows; give {} 0, which is lossless",
           {source.scale_doubt, setting::max_error}});
  const Rescale& rescale = source.rescale;
  OptionsForSamples result{options, ""};
  EncodeOptions& o = result.options;
  const double slope = std::abs(rescale.slope);
  if (slope != 1)
    for (const auto bound :
         {&EncodeOptions::max_error, &EncodeOptions::surface_error, &EncodeOptions::mesh_error}) {
      if (!(o.*bound)) continue;
      const double error = error_in_samples(*(o.*bound), rescale);
      o.*bound = error;
      if (error > 0)
        result.reason += fmt::format("{}{} allows {:.6g} steps of the stored samples ({:.6g} each)",
                                     result.reason.empty() ? "" : "; ", *(options.*bound),
                                     is_float_type(source.info.type) ? error : std::floor(error), slope);
    }
  if (o.range) {
    const double a = (o.range->first - rescale.intercept) / rescale.slope,
                 b = (o.range->second - rescale.intercept) / rescale.slope;
    o.range = std::minmax(a, b);
  }
  if (o.field_scale) *o.field_scale *= slope;
  return result;
}

CodingParameters parameters_but_scale(const EncodeOptions& options, const VolumeInfo& info) {
  options.validate();
  require_valid(check_fields(info.nrrd_fields), "this volume");
  CodingParameters p;
  p.dims = info.dims;
  p.type = info.type;
  p.mode = options.grid_only ? FileMode::grid : FileMode::voxels;
  p.effort = options.effort;
  p.grid = options.grid;
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
  require_valid(check_parameters(p), name);
  return p;
}

}  // namespace tagrid
