#include "pipeline/decode/values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "io/metadata/rescale.h"

namespace tagrid {
namespace {

struct Interval {
  double low = 0, high = 0;
};

Interval interval_of(SampleType type) {
  return with_sample_type(type, [](auto sample) {
    using S = decltype(sample);
    return Interval{static_cast<double>(std::numeric_limits<S>::lowest()),
                    static_cast<double>(std::numeric_limits<S>::max())};
  });
}

/// Which finite samples a decoded volume can have, as far as is known.
Interval range_of_samples(SampleType type, const TagIndex* index) {
  const Interval possible = interval_of(type);
  if (index == nullptr || index->total.finite == 0) return possible;
  const auto& [low, high, error] =
      std::array{index->total.low, index->total.high, std::max(index->total.max_error, 0.0)};
  return {std::max(low - error, possible.low), std::min(high + error, possible.high)};
}

/// The first of these types that has all whole numbers of an interval.
std::optional<SampleType> type_for(const Interval& values, std::initializer_list<SampleType> types) {
  for (const SampleType type : types) {
    const Interval possible = interval_of(type);
    if (values.low >= possible.low && values.high <= possible.high) return type;
  }
  return std::nullopt;
}

bool is_whole(double number) { return number == std::floor(number) && std::abs(number) < 0x1p53; }

/// The values of an interval of samples.
Interval values_of(const Interval& samples, double slope, double intercept) {
  const double a = slope * samples.low + intercept, b = slope * samples.high + intercept;
  return {std::min(a, b), std::max(a, b)};
}

/// True if integer samples have values that are integers, and float64 computes them exactly.
bool is_exact(const Interval& samples, double slope, double intercept) {
  const Interval products = values_of(samples, slope, 0);
  return is_whole(slope) && is_whole(intercept) &&
         (slope == 1 || std::max(std::abs(products.low), std::abs(products.high)) < 0x1p53);
}

/// The rule for values: their type is the first one of integers that holds all of them exactly, otherwise a float.
ValueRule rule_of_values(SampleType from, const Interval& samples, std::vector<double> slopes,
                         std::vector<double> intercepts) {
  bool are_whole = !is_float_type(from);
  Interval all = values_of(samples, slopes[0], intercepts[0]);
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    const Interval values = values_of(samples, slopes[i], intercepts[i]);
    all = {std::min(all.low, values.low), std::max(all.high, values.high)};
    are_whole = are_whole && is_exact(samples, slopes[i], intercepts[i]);
  }
  constexpr auto largest = static_cast<double>(std::numeric_limits<float>::max());
  const bool is_wide = from == SampleType::float64 || !(all.low >= -largest && all.high <= largest);
  SampleType to = is_wide ? SampleType::float64 : SampleType::float32;
  if (are_whole)
    to = type_for(all, {SampleType::int16, SampleType::uint16, SampleType::int32, SampleType::uint32})
             .value_or(to);
  return {from, to, std::move(slopes), std::move(intercepts)};
}

ValueRule rule_of_slices(const TagHeader& header, const Interval& samples) {
  const CodingParameters& p = header.parameters;
  const auto slices = rescale_of_slices(header.metadata, p.dims.z);
  if (!slices)
    throw UsageError(
        "slices have individual slopes (slice_slopes), but not one for each of {} slices, so values "
        "are unknown; leave out {}",
        p.dims.z, Setting{"values", "that values are wanted"});
  return rule_of_values(p.type, samples, slices->slopes, slices->intercepts);
}

}  // namespace

void require_scale(const Metadata& metadata, const Setting& of_values) {
  const std::string doubt = scale_doubt_in(metadata);
  if (doubt.empty()) return;
  throw UsageError("{}. The values that {} needs are therefore unknown; give {}", doubt, of_values,
                   Setting{"samples", "stored samples"});
}

VolumeInfo WrittenNumbers::info(const VolumeInfo& samples) const {
  VolumeInfo written = samples;
  written.type = type(samples.type);
  written.metadata = metadata(samples.metadata);
  return written;
}

Metadata WrittenNumbers::metadata(const Metadata& of_samples) const {
  return are_values() ? metadata_of_values(of_samples) : of_samples;
}

double WrittenNumbers::error_in_values(double error) const {
  double largest = 0;
  for (const double slope : rule.slopes) largest = std::max(largest, std::abs(slope));
  return error * largest;
}

std::optional<std::array<double, 2>> WrittenNumbers::range_in_values(double low, double high) const {
  if (rule.slopes.size() != 1) return std::nullopt;
  const double a = rule.slopes[0] * low + rule.intercepts[0], b = rule.slopes[0] * high + rule.intercepts[0];
  return std::array{std::min(a, b), std::max(a, b)};
}

bool depends_on_range(const Format& format, Numbers wanted, const TagHeader& header) {
  if (wanted == Numbers::samples || (wanted == Numbers::automatic && format.keeps.applies_rescale))
    return false;
  if (header.metadata.has_slopes_of_slices()) return wanted == Numbers::values;
  const Rescale rescale = header.metadata.rescale();
  return rescale.slope != 1 || rescale.intercept != 0;
}

WrittenNumbers numbers_of_values(const TagHeader& header, const TagIndex* index) {
  require_scale(header.metadata, {"values", "decoding to values"});
  const SampleType type = header.parameters.type;
  const Interval samples = range_of_samples(type, index);
  WrittenNumbers numbers{{type, type}};
  const Rescale rescale = header.metadata.rescale();
  if (header.metadata.has_slopes_of_slices())
    numbers.rule = rule_of_slices(header, samples);
  else if (rescale.slope != 1 || rescale.intercept != 0)
    numbers.rule = rule_of_values(type, samples, {rescale.slope}, {rescale.intercept});
  return numbers;
}

WrittenNumbers written_numbers(const Format& format, Numbers wanted, const TagHeader& header,
                               const TagIndex* index) {
  if (wanted == Numbers::values) return numbers_of_values(header, index);
  const SampleType type = header.parameters.type;
  WrittenNumbers numbers{{type, type}};
  const bool has_range = index != nullptr && index->total.finite > 0;
  const Interval samples = range_of_samples(type, index);
  if (!depends_on_range(format, wanted, header)) return numbers;
  if (header.metadata.has_slopes_of_slices()) {
    numbers.rule = rule_of_slices(header, samples);
    return numbers;
  }
  const Rescale rescale = header.metadata.rescale();
  if (rescale.slope != 1 || !is_whole(rescale.intercept) || is_float_type(type)) return numbers;
  auto to = type_for(values_of(samples, 1, rescale.intercept), {SampleType::int16, SampleType::uint16});
  if (!to && !has_range && !is_wide_type(type)) {
    // Nearly all volumes fit. If this one does not, that is found before it is complete.
    to = rescale.intercept < 0 ? SampleType::int16 : SampleType::uint16;
    numbers.is_range_known = false;
  }
  if (to) numbers.rule = {type, *to, {1}, {rescale.intercept}};
  return numbers;
}

void change_brick(const WrittenNumbers& numbers, const BrickGrid& bricks, const std::string& name,
                  DecodedBrick& brick) {
  if (!numbers.are_values()) return;
  const Box owned = bricks.owned_box(bricks.position(brick.id));
  const auto outside = make_values(numbers.rule, bricks.domain.samples_at(owned).low.z,
                                   owned.size().x * owned.size().y, brick.samples);
  if (!outside) return;
  const std::string_view type = name_of(numbers.rule.to);
  if (numbers.is_range_known)
    throw BrokenInput("{}: brick {}: the value {} exceeds the range in the index", name, brick.id,
                      outside->value);
  throw UsageError(
      "{}: the value {} is not one of type {}, and the range of values was not known before: only the "
      "end of a .tag file says it; decode a whole file instead of a pipe, or give {} (a larger "
      "type) or {} (with slope and intercept in the header)",
      name, outside->value, type, Setting{"values", "that values are wanted"},
      Setting{"samples", "that stored samples are wanted"});
}

}  // namespace tagrid
