#include "pipeline/job/resolved_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/errors/errors.h"
#include "io/metadata/rescale.h"
#include "io/tag/header.h"
#include "io/volume/one_of_volumes.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

// The field scale: this many voxels for the whole value range, so that active points do not depend on S.
constexpr double voxels_per_range = 8;

void set_range(std::pair<double, double> range, CodingParameters& p) {
  const auto [low, high] = range;
  p.range_low = low;
  p.range_high = high;
  p.field_scale = voxels_per_range / (high - low);
  // The width of a range of floats may overflow, and so may its reciprocal.
  if (!std::isfinite(high - low)) p.field_scale = 1 / (high / voxels_per_range - low / voxels_per_range);
  if (!std::isfinite(p.field_scale)) p.field_scale = high > low ? std::numeric_limits<double>::max() : 1;
}

// The mesh has the values of active voxels, and so their errors.
void require_mesh_of_voxels(const CodingParameters& p) {
  const bool two_bounds = p.surface_error >= 0;
  const double of_values = two_bounds ? p.surface_error : p.max_error;
  if (p.mesh_error < 0 || p.mesh_error >= of_values) return;
  const Setting& bound = two_bounds ? setting::surface_error : setting::max_error;
  const Sentence refusal{
      "{0} {1} cannot be kept with {2} {3}: the values of the mesh are off by up to {3}; give {0} {3} or "
      "more, or {2} {1} or less",
      setting::mesh_error, p.mesh_error, bound, of_values};
  if (two_bounds) throw UsageError(refusal);
  throw UsageError("{}, or add {} {}", refusal, setting::surface_error, p.mesh_error);
}

void set_bounds(const EncodeOptions& options, CodingParameters& p) {
  const auto whole = [&](const std::optional<double>& e) { return e ? kept_bound(*e, p.type) : -1.0; };
  // Until the rule has given a bound, any that is not 0 stands for it.
  const std::optional<double> max_error =
      options.error_rule ? 2 * options.surface_error.value_or(0) + 1 : options.max_error;
  p.mesh_error = whole(options.mesh_error);
  p.grid = options.grid.value();
  if (p.mode == FileMode::voxels) {
    p.max_error = std::max(whole(max_error), 0.0);
    p.surface_error = whole(options.surface_error);
    require(p.surface_error < p.max_error || p.surface_error < 0,
            {"{} must be below {} after both are rounded down to whole units", setting::surface_error,
             setting::max_error});
    if (!options.error_rule) require_mesh_of_voxels(p);
    if (p.counts_points() && p.implies_grid()) p.grid = GridOrigin::implied;
    return;
  }
  p.max_error = whole(max_error);
  if (p.max_error < 0) return;
  // The error of a voxel is at most E_m (interpolation) + E_n (stored points). Rounding once keeps a number
  // within E of an integer. For floats, the mesh criterion subtracts the rounding errors.
  const double tighter = p.mesh_error < 0 ? p.max_error : std::min(p.mesh_error, p.max_error);
  p.point_error = kept_bound(tighter / 2, p.type);
}

// Refuses to write a file that a reader would refuse.
void require_valid(const Status& status, const std::string& volume) {
  require(status.ok(), {"{} cannot be encoded: {}", volume, status.what()});
}

// The same for parameters that are complete; with_range() checks those that are not yet.
void require_valid(const ResolvedOptions& options) {
  if (!options.range_from_data) require_valid(check_parameters(options.parameters), options.volume);
  require_valid(check_volumes(options.parameters, options.volumes), options.volume);
}

// Rules follow from the samples, whatever they stand for.
bool bounds_values(const EncodeOptions& options) {
  return options.max_error.value_or(0) > 0 || options.surface_error.value_or(0) > 0 ||
         options.mesh_error.value_or(0) > 0 || !options.thresholds.empty();
}

// The least sample of the upper side of a threshold: of values that are at least it, or with a negative slope, below it.
// Nothing if all samples of the type are on one side.
template <class T>
std::optional<double> least_of_upper_side(double threshold, const Rescale& rescale) {
  if (rescale.slope == 1 && rescale.intercept == 0) return threshold_of(threshold, sample_type_of<T>());
  if constexpr (std::is_floating_point_v<T>) {
    // Values of neighboring samples are rounded to the same number, in a way that depends on who computes them.
    throw UsageError("{} is not possible for floats with a slope or an intercept", setting::threshold);
  } else {
    const auto is_upper = [&](std::int64_t sample) {
      const double value = rescale.slope * static_cast<double>(sample) + rescale.intercept;
      return rescale.slope > 0 ? value >= threshold : value < threshold;
    };
    std::int64_t lower = std::numeric_limits<T>::min(), upper = std::numeric_limits<T>::max();
    if (is_upper(lower) || !is_upper(upper)) return {};
    while (upper - lower > 1) {
      const std::int64_t middle = lower + (upper - lower) / 2;
      (is_upper(middle) ? upper : lower) = middle;
    }
    return static_cast<double>(upper);
  }
}

Thresholds thresholds_in_samples(const std::vector<double>& values, const Rescale& rescale, SampleType type) {
  std::vector<double> samples;
  for (const double value : values)
    with_sample_type(type, [&](auto sample) {
      const auto least = least_of_upper_side<decltype(sample)>(value, rescale);
      require(least.has_value(), {"{} {}: all values that samples of {} can have are on one side of it",
                                  setting::threshold, value, name_of(type)});
      samples.push_back(*least);
    });
  std::ranges::sort(samples);
  samples.erase(std::unique(samples.begin(), samples.end()), samples.end());
  Thresholds thresholds;
  for (const double sample : samples) thresholds.append(sample);
  return thresholds;
}

// Turns what is given for values into what it is for samples. Returns how bounds follow from those of values.
std::string turn_into_samples(const Rescale& rescale, SampleType type, EncodeOptions& o) {
  const double slope = std::abs(rescale.slope);
  std::string reason;
  if (slope != 1)
    for (std::optional<double>* bound : {&o.max_error, &o.surface_error, &o.mesh_error}) {
      if (!*bound) continue;
      const double given = **bound, error = error_in_samples(given, rescale);
      *bound = error;
      if (!reason.empty() && given > 0) reason += "; ";
      if (const double steps = kept_bound(error, type); steps > 0)
        reason += fmt::format("{} allows {:.6g} step{} of the stored samples ({:.6g} each)", given, steps,
                              steps == 1 ? "" : "s", slope);
      else if (given > 0)
        reason += fmt::format("{} is less than one step of the stored samples ({:.6g} each), so it becomes 0",
                              given, slope);
    }
  if (o.range) {
    const double a = (o.range->first - rescale.intercept) / rescale.slope,
                 b = (o.range->second - rescale.intercept) / rescale.slope;
    o.range = std::minmax(a, b);
  }
  if (o.field_scale) *o.field_scale *= slope;
  return reason;
}

// At low rates, what each brick takes in any case would matter.
constexpr int length_of_transformed_bricks = 128;

CodingParameters parameters_but_scale(const EncodeOptions& options, const VolumeInfo& info) {
  CodingParameters p;
  p.dims = info.dims;
  p.type = info.type;
  p.mode = options.grid_only ? FileMode::grid : FileMode::voxels;
  p.effort = options.effort;
  p.cube_size = options.cube_size;
  // Until the rule has given a step, any that is not 0 stands for it.
  p.transform_step = options.may_be_transformed() ? 1 : 0;
  p.brick_edge = options.brick_edge.value_or(
      p.transform_step > 0 ? std::max(2, length_of_transformed_bricks / options.cube_size)
                           : usual_brick_edge(options.cube_size));
  p.lead = options.lead;
  p.max_level = options.max_level.value_or(max_level(options.cube_size));
  p.accuracy = options.accuracy;
  set_bounds(options, p);
  return p;
}

std::vector<int> overviews_of(const EncodeOptions& options, const VolumeInfo& info) {
  // The mean of samples from slices with different scales is the mean of no values.
  const bool possible = !info.metadata.has_slopes_of_slices();
  if (!options.overviews) return possible && !options.grid_only ? factors_for(info.dims) : std::vector<int>();
  require(possible || options.overviews->empty(),
          {"{} are means, but each slice of this volume has its own slope and intercept; give {} none",
           setting::overviews, setting::overviews});
  return *options.overviews;
}

}  // namespace

// It does not depend on the data, so that files and pipes give the same bytes.
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
      return {0, 0};
  }
}

ResolvedOptions in_samples(const EncodeOptions& options, const SourceFacts& source) {
  options.validate();
  require(source.scale_doubt.empty() || !bounds_values(options),
          {"{}. The bound therefore cannot be converted to stored samples; give {} 0, which is lossless",
           source.scale_doubt, setting::max_error});
  const VolumeInfo info = info_of_volume(source, 0);
  require(options.thresholds.empty() || !info.metadata.has_slopes_of_slices(),
          {"each slice of this volume has its own slope and intercept, so {} are different samples in each; "
           "leave "
           "out {}",
           setting::threshold, setting::threshold});
  require_valid(check_metadata(info.metadata), "this volume");
  ResolvedOptions resolved;
  resolved.options = options;
  EncodeOptions& o = resolved.options;
  if (!o.grid) o.grid = o.may_be_transformed() ? GridOrigin::derived : GridOrigin::stored;
  resolved.reason_of_bound = turn_into_samples(source.rescale, info.type, o);
  o.validate();
  resolved.volume = source.files.empty() ? "this volume" : source.shown_name();
  resolved.metadata = o.strip ? stripped(info.metadata) : info.metadata;
  resolved.parameters = parameters_but_scale(o, info);
  resolved.parameters.thresholds = thresholds_in_samples(o.thresholds, source.rescale, info.type);
  resolved.volumes = static_cast<int>(source.info.volumes);
  resolved.overviews = overviews_of(o, info);
  resolved.range_from_data = !o.range && !o.field_scale && (o.range_from_data || is_wide_type(info.type));
  if (o.field_scale)
    resolved.parameters.field_scale = *o.field_scale;
  else if (!resolved.range_from_data)
    set_range(o.range.value_or(usual_range(info.type)), resolved.parameters);
  require_valid(resolved);
  return resolved;
}

std::vector<std::pair<std::string, std::string>> in_words(const CodingParameters& p) {
  const auto bound = [](double value) { return value < 0 ? "none" : fmt::format("{}", value); };
  const bool ranged = p.range_low < p.range_high;
  const std::pair<const Setting&, std::string> words[] = {
      {setting::grid_only, p.mode == FileMode::grid ? "given" : "not given"},
      {setting::grid, std::string(name_of(p.grid))},
      {setting::max_error, bound(p.max_error)},
      {setting::surface_error, bound(p.surface_error)},
      {setting::mesh_error, bound(p.mesh_error)},
      {setting::threshold,
       p.thresholds.count == 0 ? "none" : fmt::format("{}", fmt::join(p.thresholds.numbers(), ","))},
      {setting::effort, std::string(name_of(p.effort))},
      {setting::accuracy, fmt::format("{}", p.accuracy)},
      {setting::cube, fmt::format("{}", p.cube_size)},
      {setting::brick, fmt::format("{}", p.brick_edge)},
      {setting::lead, fmt::format("{}", p.lead)},
      {setting::max_level, fmt::format("{}", p.max_level)},
      {setting::range, ranged ? fmt::format("{}:{}", p.range_low, p.range_high) : "not given"},
      {setting::field_scale, fmt::format("{}", p.field_scale)},
  };
  std::vector<std::pair<std::string, std::string>> all;
  for (const auto& [named, text] : words) all.emplace_back(named.name, text);
  return all;
}

ResolvedOptions with_bound(ResolvedOptions options, std::optional<double> max_error, double transform_step,
                           const FilterWeights& filter) {
  options.options.max_error = max_error;
  options.options.error_rule.reset();
  options.options.validate();
  set_bounds(options.options, options.parameters);
  options.parameters.transform_step = transform_step;
  options.parameters.filter = filter;
  if (transform_step == 0) options.parameters.brick_edge = options.usual_edge();
  require_valid(options);
  return options;
}

CodingParameters with_range(const ResolvedOptions& options, std::pair<double, double> range) {
  CodingParameters p = options.parameters;
  set_range(range, p);
  require_valid(check_parameters(p), options.volume);
  return p;
}

}  // namespace tagrid
