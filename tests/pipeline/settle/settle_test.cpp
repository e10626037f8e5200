// From options to a job, without an encoding.
#include "pipeline/settle/settle.h"

#include <gtest/gtest.h>

#include "io/errors/errors.h"
#include "io/formats/table/open_volume.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

SourceFacts facts_of(SampleType type, double slope = 1) {
  SourceFacts facts;
  facts.info.dims = {9, 8, 7};
  facts.info.type = type;
  facts.files = {"scan.nrrd"};
  facts.rescale.slope = slope;
  return facts;
}

EncodeOptions bounded(double max_error) {
  EncodeOptions options{.max_error = max_error};
  return options;
}

double bound_in_samples(double bound, double slope) {
  return in_samples(bounded(bound), facts_of(SampleType::int16, slope)).parameters.max_error;
}

TEST(ResolvedOptions, TellBoundsApartByWhatTheyAllowInSamples) {
  EXPECT_EQ(bound_in_samples(0.9, 1), bound_in_samples(0.1, 1));
  EXPECT_EQ(bound_in_samples(0.9, 0.1), 9);
  EXPECT_EQ(bound_in_samples(0.1, 0.1), 1);
  EXPECT_EQ(bound_in_samples(0.1, -0.1), 1);
}

TEST(ResolvedOptions, AreCompleteUnlessTheSamplesAreNeeded) {
  EXPECT_FALSE(in_samples({}, facts_of(SampleType::int16)).range_from_data);
  EXPECT_GT(in_samples({}, facts_of(SampleType::int16)).parameters.field_scale, 0);
  EXPECT_TRUE(in_samples({}, facts_of(SampleType::float32)).range_from_data);
  EncodeOptions options{.range = {{0, 10}}};
  EXPECT_FALSE(in_samples(options, facts_of(SampleType::float32)).range_from_data);
}

TEST(ResolvedOptions, HaveTheRangeOfSamplesWhereThatOfValuesWasGiven) {
  EncodeOptions options{.range = {{0, 10}}};
  const CodingParameters p = in_samples(options, facts_of(SampleType::int16, -2)).parameters;
  EXPECT_EQ(p.range_low, -5);
  EXPECT_EQ(p.range_high, 0);
}

TEST(ResolvedOptions, AreCheckedAgainWhenARuleHasGivenTheBound) {
  EncodeOptions options{.error_rule = ErrorRule{ErrorRule::Kind::noise, 1}};
  ResolvedOptions resolved = in_samples(options, facts_of(SampleType::int16));
  EXPECT_EQ(with_bound(resolved, 7).parameters.max_error, 7);
  resolved.parameters.range_low = INFINITY;
  EXPECT_THROW(with_bound(resolved, 7), UsageError);
}

// What the samples tell is not read, but refused with the setting that would make it unnecessary.
TEST(Settle, WithoutSamplesRefusesWhatFollowsFromThem) {
  EncodeOptions by_noise, by_range;
  by_noise.error_rule = ErrorRule{ErrorRule::Kind::noise, 1};
  by_range.range_from_data = true;
  for (const EncodeOptions& options : {by_noise, by_range})
    EXPECT_THROW(settle(options, facts_of(SampleType::int16), {Resources(1)}), UsageError);
  EXPECT_THROW(settle({}, facts_of(SampleType::float32), {Resources(1)}), UsageError);
  EXPECT_EQ(settle({}, facts_of(SampleType::int16), {Resources(1)}).times_read, 0);
}

class SettledVolume : public TemporaryFolder {
 protected:
  SettledVolume() { write_nrrd(path("in.nrrd"), dims_, blobs<float>(dims_, 1, 20)); }
  EncodeJob job_of(const EncodeOptions& options, const EarlierFindings& earlier = {}) {
    const auto source = open_volume(path("in.nrrd"), {});
    EncodeJob job = settle(options, *source, {.resources = Resources(1), .earlier = earlier});
    EXPECT_EQ(source->next_sample(), 0);
    return job;
  }
  const Index3 dims_ = {33, 22, 11};
};

TEST_F(SettledVolume, HasTheRangeOfItsSamples) {
  const auto samples = blobs<float>(dims_, 1, 20);
  const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
  const EncodeJob job = job_of({});
  EXPECT_EQ(job.parameters().range_low, *low);
  EXPECT_EQ(job.parameters().range_high, *high);
  EXPECT_EQ(job.times_read, 1);
}

TEST_F(SettledVolume, TakesWhatAnEarlierRunFound) {
  EncodeOptions options{.error_rule = ErrorRule{ErrorRule::Kind::psnr, 50}};
  const EncodeJob job =
      job_of(options, {.max_error = 7, .reason_of_bound = "found before", .range = {{1, 2}}});
  EXPECT_EQ(job.parameters().max_error, 7);
  EXPECT_EQ(job.parameters().range_high, 2);
  EXPECT_EQ(job.reason_of_bound, "found before");
  EXPECT_EQ(job.parameters().transform_step, 0);
  EXPECT_EQ(job.times_read, 0);
}

TEST_F(SettledVolume, OfOneValueHasARangeAllTheSame) {
  write_nrrd(path("in.nrrd"), dims_,
             std::vector<float>(static_cast<std::size_t>(Box::of_size(dims_).count()), 3));
  const EncodeJob job = job_of({});
  EXPECT_EQ(job.parameters().range_low, 3);
  EXPECT_EQ(job.parameters().range_high, 4);
}

}  // namespace
}  // namespace tagrid
