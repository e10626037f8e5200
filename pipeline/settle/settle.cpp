#include "pipeline/settle/settle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "io/errors/errors.h"
#include "pipeline/settle/search.h"
#include "pipeline/settle/source_survey.h"

namespace tagrid {
namespace {

double width(const std::optional<std::pair<double, double>>& range) {
  return range ? range->second - range->first : 0;
}

FoundBound by_noise(VolumeSource& source, double times) {
  const Noise noise = noise_of(source);
  return {times * noise.deviation, fmt::format("the noise is {:.4g} (standard deviation)", noise.deviation),
          noise.doubt, 0, noise.times_read};
}

FoundBound by_range(VolumeSource& source, double part) {
  const auto range = range_of_data(source);
  return {part * width(range),
          range ? fmt::format("the samples lie between {} and {}", range->first, range->second)
                : "no sample is finite",
          "", 0, 1};
}

// The largest error by the rule of the options. Reads the volume and rewinds it: a sample for the noise, all
// of it for its range, and several times for a PSNR or a size. Throws UsageError if the bound cannot be combined with
// the other options.
FoundBound bound_of_rule(const ResolvedOptions& options, const EncodePlan& plan, VolumeSource& source,
                         const Progress& progress) {
  const auto [kind, value] = options.options.error_rule.value();
  const bool by_noise_of_samples = kind == ErrorRule::Kind::noise,
             by_range_of_samples = kind == ErrorRule::Kind::relative;
  FoundBound found = by_noise_of_samples   ? by_noise(source, value)
                     : by_range_of_samples ? by_range(source, value)
                                           : bound_by_trials(options, plan, source, false, progress);
  found.max_error = std::min(found.max_error, std::numeric_limits<double>::max());
  found.max_error = kept_bound(found.max_error, source.info().type);
  found.reason = found.step > 0 ? fmt::format("a wavelet with a step of {:.4g}, {}; no error is above {:.6g}",
                                              found.step, found.reason, found.max_error)
                 : by_noise_of_samples || by_range_of_samples
                     ? fmt::format("{}, so the maximum error is set to {}", found.reason, found.max_error)
                     : fmt::format("maximum error set to {}, {}", found.max_error, found.reason);
  return found;
}

std::pair<double, double> range_for(VolumeSource& source) {
  auto range = range_of_data(source).value_or(std::pair(0.0, 0.0));
  if (range.first == range.second) ++range.second;  // a constant volume: any scale is good
  return range;
}

void require_known_range(const ResolvedOptions& options) {
  require(!options.range_from_data || options.options.range_from_data,
          {"a pipe of {} samples needs {} lo:hi or {}: its range is not known before it has been read",
           name_of(options.parameters.type), setting::range, setting::field_scale});
}

// The plan for parameters that may have smaller bricks than those of the options.
EncodePlan plan_of(const CodingParameters& parameters, const ResolvedOptions& options,
                   const Settling& settling) {
  EncodeNeeds needs = settling.needs;
  needs.sums = settling.encodes && !options.overviews.empty();
  return plan_encoding(parameters, settling.resources, settling.any_rows, needs);
}

}  // namespace

EncodePlan plan_of(const ResolvedOptions& options, const Settling& settling) {
  return plan_of(options.parameters, options, settling);
}

Look look_of(const ResolvedOptions& options, const EarlierFindings& earlier) {
  const bool finds_range = options.options.range_from_data && !earlier.range;
  if (options.options.error_rule && !earlier.max_error) {
    const ErrorRule::Kind kind = options.options.error_rule->kind;
    if (kind == ErrorRule::Kind::noise) return Look::a_few_rows;
    if (kind != ErrorRule::Kind::relative) return Look::all_rows_often;
    return Look::again;
  }
  return finds_range ? Look::again : Look::once;
}

EncodeJob planned(const ResolvedOptions& options, const Settling& settling) {
  EncodeJob job{{options.parameters, options.metadata, options.volumes}};
  job.plan = plan_of(options, settling);
  job.memory = job.plan.memory;
  job.overviews = options.overviews;
  job.reason_of_bound = options.reason_of_bound;
  return job;
}

void find_in_samples(EncodeJob& job, const ResolvedOptions& options, VolumeSource& volume,
                     const Settling& settling) {
  const EarlierFindings& earlier = settling.earlier;
  ResolvedOptions settled = options;
  if (options.options.error_rule) {
    FoundBound found = {earlier.max_error.value_or(0), earlier.reason_of_bound, {}, earlier.transform_step};
    found.filter = earlier.filter;
    if (!earlier.max_error) found = bound_of_rule(options, job.plan, volume, settling.searching);
    settled = with_bound(options, found.max_error, found.step, found.filter);
    job.reason_of_bound = found.reason;
    job.doubt_of_bound = found.doubt;
    job.times_read = found.times_read;
  }
  if (!volume.traits().again) require_known_range(options);
  if (settled.range_from_data && !earlier.range) ++job.times_read;
  job.header.parameters = earlier.range && settled.range_from_data ? with_range(settled, *earlier.range)
                                                                   : with_range_of(settled, volume);
  // A bound that was found has smaller bricks than a transform would have.
  if (job.parameters().brick_edge != options.parameters.brick_edge)
    job.plan = plan_of(job.parameters(), options, settling);
}

EncodeJob settle(const EncodeOptions& given, VolumeSource& volume, const Settling& settling) {
  const ResolvedOptions options = in_samples(given, volume.facts());
  EncodeJob job = planned(options, settling);
  find_in_samples(job, options, volume, settling);
  return job;
}

EncodeJob settle(const EncodeOptions& given, const SourceFacts& volume, const Settling& settling) {
  const ResolvedOptions options = in_samples(given, volume);
  EncodeJob job = planned(options, settling);
  require_known_range(options);
  require(!options.options.error_rule && !options.range_from_data,
          {"{} follows from the samples, which cannot be read beforehand",
           options.range_from_data ? setting::range : setting::max_error});
  return job;
}

CodingParameters with_range_of(const ResolvedOptions& options, VolumeSource& volume) {
  return options.range_from_data ? with_range(options, range_for(volume)) : options.parameters;
}

}  // namespace tagrid
