#include "pipeline/job/settle.h"

#include "io/errors/errors.h"
#include "pipeline/job/bound_of_rule.h"
#include "pipeline/job/source_survey.h"

namespace tagrid {
namespace {

std::pair<double, double> range_for(VolumeSource& source) {
  auto range = range_of_data(source).value_or(std::pair(0.0, 0.0));
  if (range.first == range.second) ++range.second;  // a constant volume: any scale is good
  return range;
}

EncodeJob job_of(const ResolvedOptions& options, const EncodePlan& plan) {
  return {{options.parameters, options.fields}, plan, options.reason_of_bound};
}

void require_known_range(const ResolvedOptions& options) {
  require(!options.range_from_data || options.options.range_from_data,
          {"a pipe of {} samples needs {} lo:hi or {}: its range is not known before it has been read",
           {name_of(options.parameters.type), setting::range, setting::field_scale}});
}

}  // namespace

EncodeJob settle(const ResolvedOptions& options, const EncodePlan& plan, VolumeSource& source,
                 const Progress& searching, const EarlierFindings& earlier) {
  EncodeJob job = job_of(options, plan);
  ResolvedOptions settled = options;
  if (options.options.error_rule) {
    FoundBound found = {earlier.max_error.value_or(0), earlier.reason_of_bound};
    if (!earlier.max_error) found = bound_of_rule(options, source, plan.budget.threads, searching);
    settled = with_bound(options, found.max_error);
    job.reason_of_bound = found.reason;
  }
  if (!source.traits().again) require_known_range(options);
  job.header.parameters = settled.parameters;
  if (settled.range_from_data) {
    job.times_read = earlier.range ? 0 : 1;
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
