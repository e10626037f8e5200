#include "pipeline/job/settle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "io/errors/errors.h"
#include "pipeline/job/search.h"
#include "pipeline/job/source_survey.h"
#include "pipeline/threads/threads.h"

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

FoundBound by_trials(const ResolvedOptions& options, VolumeSource& source, const Progress& progress) {
  return bound_by_trials(options, source, false, progress);
}

// The largest error by the rule of the options. Reads the volume and rewinds it: a sample for the noise, all
// of it for its range, and several times for a PSNR or a size. Throws UsageError if the bound cannot be combined with
// the other options.
FoundBound bound_of_rule(const ResolvedOptions& options, VolumeSource& source, int threads,
                         const Progress& progress) {
  const auto [kind, value] = options.options.error_rule.value();
  const bool by_noise_of_samples = kind == ErrorRule::Kind::noise,
             by_range_of_samples = kind == ErrorRule::Kind::relative;
  FoundBound found;
  Threads(std::max(threads, 1)).run([&, value = value] {
    found = by_noise_of_samples   ? by_noise(source, value)
            : by_range_of_samples ? by_range(source, value)
                                  : by_trials(options, source, progress);
  });
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

EncodeJob job_of(const ResolvedOptions& options, const EncodePlan& plan) {
  return {{options.parameters, options.metadata, options.volumes},
          plan,
          options.overviews,
          options.reason_of_bound};
}

void require_known_range(const ResolvedOptions& options) {
  require(!options.range_from_data || options.options.range_from_data,
          {"a pipe of {} samples needs {} lo:hi or {}: its range is not known before it has been read",
           {name_of(options.parameters.type), setting::range, setting::field_scale}});
}

}  // namespace

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

EncodeJob settle(const ResolvedOptions& options, const EncodePlan& plan, VolumeSource& source,
                 const Progress& searching, const EarlierFindings& earlier) {
  EncodeJob job = job_of(options, plan);
  ResolvedOptions settled = options;
  if (options.options.error_rule) {
    FoundBound found = {earlier.max_error.value_or(0), earlier.reason_of_bound, {}, earlier.transform_step};
    if (!earlier.max_error) found = bound_of_rule(options, source, plan.budget.threads, searching);
    settled = with_bound(options, found.max_error, found.step);
    job.reason_of_bound = found.reason;
    job.doubt_of_bound = found.doubt;
    job.times_read = found.times_read;
  }
  if (!source.traits().again) require_known_range(options);
  job.header.parameters = settled.parameters;
  if (settled.range_from_data) {
    job.times_read += earlier.range ? 0 : 1;
    job.header.parameters = with_range(settled, earlier.range ? *earlier.range : range_for(source));
  }
  return job;
}

EncodeJob settle(const ResolvedOptions& options, const EncodePlan& plan) {
  require_known_range(options);
  require(!options.options.error_rule && !options.range_from_data,
          {"{} follows from the samples, which cannot be read beforehand",
           {options.range_from_data ? setting::range : setting::max_error}});
  return job_of(options, plan);
}

}  // namespace tagrid
