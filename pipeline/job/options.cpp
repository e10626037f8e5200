#include "pipeline/job/options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "stages/bound/bounds.h"
#include "stages/grid/lattice.h"
#include "stages/overview/block_sums.h"

namespace tagrid {
namespace {

void require_bound(const std::optional<double>& bound, const Setting& setting) {
  require(!bound || is_bound(*bound),
          {"{} {} must be a finite number of at least 0", setting, bound.value_or(0)});
}

void validate_rule(const EncodeOptions& options) {
  namespace set = setting;
  const ErrorRule& rule = *options.error_rule;
  const Setting& own = setting_of(rule.kind);
  require(std::isfinite(rule.value) && rule.value > 0, {"{} must be a positive number", own});
  require(!options.max_error || rule.kind == ErrorRule::Kind::psnr,
          {"{} and {} both set the maximum error; give only one", set::max_error, own});
  require(!rule.is_tried() || !options.grid_only,
          {"{} is found by coding voxels; it cannot be combined with {}", own, set::grid_only});
  require(!rule.is_tried() || !options.surface_error,
          {"{} gives one bound for all voxels; it cannot be combined with {}", own, set::surface_error});
  require(!rule.is_size() || !options.mesh_error,
          {"{} limits the size of the voxels; it cannot be combined with {}", own, set::mesh_error});
  require(!rule.is_size() || options.grid != GridOrigin::stored,
          {"{} limits the size of the voxels; it cannot be combined with {} stored", own, set::grid});
}

}  // namespace

const Setting& setting_of(ErrorRule::Kind kind) {
  using Kind = ErrorRule::Kind;
  return kind == Kind::relative ? setting::relative_error
         : kind == Kind::psnr   ? setting::psnr
         : kind == Kind::ratio  ? setting::ratio
         : kind == Kind::bits   ? setting::bits
                                : setting::max_error;
}

std::vector<int> factors_for(const Index3& dims) {
  const std::int64_t longest = std::max({dims.x, dims.y, dims.z});
  std::vector<int> factors;
  if (longest <= 512) return factors;
  for (std::int64_t factor = block_edge; factor <= largest_factor; factor *= block_edge) {
    factors.push_back(static_cast<int>(factor));
    if ((longest - 1) / factor + 1 <= 256) break;
  }
  return factors;
}

std::string text_of(const std::vector<int>& factors) {
  return factors.empty() ? "none" : fmt::format("{}", fmt::join(factors, ","));
}

std::string text_of_rule(const EncodeOptions& options) {
  constexpr const char* kinds[] = {"noise", "relative", "psnr", "ratio", "bits"};
  const ErrorRule& rule = options.error_rule.value();
  const std::string text = fmt::format("{} {}", kinds[static_cast<std::size_t>(rule.kind)], rule.value);
  return options.max_error ? fmt::format("{}, within {}", text, *options.max_error) : text;
}

void EncodeOptions::validate() const {
  namespace set = setting;
  require_bound(max_error, set::max_error);
  require_bound(surface_error, set::surface_error);
  require_bound(mesh_error, set::mesh_error);
  require(!surface_error || !grid_only,
          {"{} is a bound on voxels; it cannot be combined with {}", set::surface_error, set::grid_only});
  if (error_rule) validate_rule(*this);
  require(!surface_error || max_error || error_rule,
          {"{} needs {}, the bound on the other voxels", set::surface_error, set::max_error});
  require(!surface_error || !max_error || *surface_error < *max_error,
          {"{} must be below {}", set::surface_error, set::max_error});
  const auto needs_stored = [](const Setting& what) {
    return Sentence("{} needs the grid in the file; it cannot be combined with {} derived", what, set::grid);
  };
  require(thresholds.empty() || !grid_only,
          {"{} are for voxels; they cannot be combined with {}", set::threshold, set::grid_only});
  require(thresholds.size() <= most_thresholds, {"{} are at most {}", set::threshold, most_thresholds});
  for (std::size_t i = 0; i < thresholds.size(); ++i)
    require(std::isfinite(thresholds[i]) && (i == 0 || thresholds[i] > thresholds[i - 1]),
            {"{} must be increasing finite numbers", set::threshold});
  const bool derived = grid == GridOrigin::derived;
  require(!derived || !grid_only, needs_stored(set::grid_only));
  require(!derived || !surface_error, needs_stored(set::surface_error));
  require(!derived || !mesh_error, needs_stored(set::mesh_error));
  require(accuracy >= 3 && accuracy <= max_accuracy,
          {"{} must be a whole number from 3 to 1000000", set::accuracy});
  require(cube_size >= min_cube_size && cube_size <= max_cube_size &&
              std::has_single_bit(static_cast<unsigned>(cube_size)),
          {"{} must be a power of two from 4 to 256", set::cube});
  require(lead == 0 || lead == 1, {"{} must be 0 or 1", set::lead});
  const int deepest = tagrid::max_level(cube_size);
  require(
      !max_level || (*max_level >= 0 && *max_level <= deepest),
      {"{} must be from 0 to {}, because root cubes have an edge of {}", set::max_level, deepest, cube_size});
  const bool bounded = max_error || error_rule;
  const bool limited = max_level && *max_level < deepest;
  const auto no_bound = [](const Setting& bound) {
    return Sentence("a grid that is limited by {} cannot keep a bound; leave out {}", set::max_level, bound);
  };
  require(!limited || !grid_only || !bounded, no_bound(set::max_error));
  require(!limited || !mesh_error, no_bound(set::mesh_error));
  require(!brick_edge || (*brick_edge >= 1 && *brick_edge <= 512 / cube_size),
          {"{} must be at least 1, and the edge of a brick at most 512 samples", set::brick});
  if (overviews) {
    require(!grid_only || overviews->empty(),
            {"{} are made of voxels; they cannot be combined with {}", set::overviews, set::grid_only});
    int before = 1;
    for (const int factor : *overviews) {
      require(factor > before && factor <= largest_factor &&
                  std::has_single_bit(static_cast<unsigned>(factor)) &&
                  std::countr_zero(static_cast<unsigned>(factor)) % 2 == 0,
              {"{} must be increasing powers of 4, from 4 to 1024", set::overviews});
      before = factor;
    }
  }
  require(!field_scale || (std::isfinite(*field_scale) && *field_scale > 0),
          {"{} must be positive", set::field_scale});
  require(!field_scale || (!range && !range_from_data),
          {"{} and {} have the same meaning; give only one", set::field_scale, set::range});
  require(
      !range || (std::isfinite(range->first) && std::isfinite(range->second) && range->first < range->second),
      {"{} must be lo:hi with lo < hi", set::range});
}

}  // namespace tagrid
