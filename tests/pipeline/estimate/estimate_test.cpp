// Estimates against the encodings themselves, and bounds that follow from the samples.
#include "pipeline/estimate/estimate.h"

#include <cmath>
#include <limits>
#include <set>

#include "io/errors/errors.h"
#include "io/formats/table/open_volume.h"
#include "pipeline/memory/plan.h"
#include "pipeline/settle/settle.h"
#include "pipeline/settle/source_survey.h"
#include "pipeline/verify/verify.h"
#include "tests/support/points.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

class EstimatedVolume : public TemporaryFolder {
 protected:
  EncodeResult encode(EncodeOptions options, double max_error) const {
    options.error_rule.reset();
    options.max_error = max_error;
    return encode_volume(in_, {}, path("a.tag"), true, options, Resources(2));
  }
  EncodeResult encoded(const EncodeOptions& options) const {
    return encode_volume(in_, {}, path("a.tag"), true, options, Resources(2));
  }
  void make_phantom(Index3 dims, SampleType type, std::uint64_t seed = 1) const {
    write_phantom({.dims = dims, .type = type, .seed = seed}, in_, format_named("nrrd"), true, 2);
  }
  EstimateResult estimate(const EncodeOptions& options, const std::vector<double>& errors,
                          int threads = 2) const {
    return estimate_encoding(
        {.input = in_, .options = options, .max_errors = errors, .resources = Resources(threads)});
  }
  EncodeJob settled(const EncodeOptions& options, int threads = 2) const {
    const auto source = open_volume(in_);
    return settle(options, *source, {Resources(threads)});
  }
  double bound_of(const EncodeOptions& options) const { return settled(options).parameters().max_error; }
  static EncodeOptions rule(ErrorRule::Kind kind, double value) {
    EncodeOptions options{.error_rule = ErrorRule{kind, value}, .cube_size = 16};
    return options;
  }

  const std::string in_ = path("in.nrrd");
};

template <class T>
class EstimatesOfType : public EstimatedVolume {};
TYPED_TEST_SUITE(EstimatesOfType, AllTypes);

// A small volume is encoded whole, so that only the index is inferred.
TYPED_TEST(EstimatesOfType, OfASmallVolumeAreItsEncodings) {
  const Index3 dims = {50, 41, 37};
  write_nrrd(this->in_, dims, blobs<TypeParam>(dims, 1));
  for (int mode = 0; mode < 4; ++mode) {
    EncodeOptions options{
        .grid_only = mode == 1, .grid = mode == 2 ? GridOrigin::derived : GridOrigin::stored, .cube_size = 8};
    if (mode == 3) options.surface_error = 0.5;
    const std::vector<double> errors = mode == 3 ? std::vector{1.0, 6.0} : std::vector{0.0, 1.0, 6.0};
    const EstimateResult result = this->estimate(options, errors);
    EXPECT_EQ(result.encoded, result.bricks);
    ASSERT_EQ(result.estimates.size(), errors.size());
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const EncodeResult encoded = this->encode(options, errors[i]);
      const Estimate& e = result.estimates[i];
      EXPECT_EQ(e.max_error, encoded.header.parameters.max_error);
      EXPECT_NEAR(e.file_bytes / static_cast<double>(encoded.file_bytes), 1, 0.01)
          << mode << " " << errors[i];
      const Achieved achieved = achieved_of(encoded.index.total);
      EXPECT_NEAR(e.rmse, achieved.rmse, 1e-9 * achieved.rmse);
      EXPECT_EQ(std::isnan(e.psnr), achieved.rmse == 0);
      if (achieved.rmse > 0) {
        EXPECT_NEAR(e.psnr, achieved.psnr, 1e-6);
      }
    }
  }
}

// What overviews add is small beside the rest, so it is compared alone.
TYPED_TEST(EstimatesOfType, OfOverviewsAreWithinATenth) {
  const Index3 dims = {90, 81, 77};
  write_nrrd(this->in_, dims, blobs<TypeParam>(dims, 1), "spacings: 1 2 3\na key:=with a value\n");
  const std::vector<double> errors = {0.0, 6.0};
  const auto without = this->estimate({.overviews = std::vector<int>()}, errors);
  for (const std::vector<int>& factors : {std::vector{4}, {4, 16}, {16}}) {
    const auto with = this->estimate({.overviews = factors}, errors);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const EncodeResult encoded = this->encode({.overviews = factors}, errors[i]),
                         plain = this->encode({.overviews = std::vector<int>()}, errors[i]);
      const auto really = static_cast<double>(encoded.file_bytes - plain.file_bytes);
      const double added = with.estimates[i].file_bytes - without.estimates[i].file_bytes;
      // A coarse level alone is guessed.
      const double accuracy = factors[0] == 4 ? 0.1 : 1;
      EXPECT_NEAR(added / really, 1, accuracy) << factors.size() << " " << errors[i] << " " << really;
      EXPECT_GT(with.estimates[i].encoding_seconds, 0);
    }
  }
}

// By default, long volumes have them, and grids have none.
TEST_F(EstimatedVolume, OfFilesWithOverviewsByDefaultCountThem) {
  const Index3 dims = {600, 40, 37};
  write_nrrd(in_, dims, blobs<std::int16_t>(dims, 1));
  for (const bool grid_only : {false, true}) {
    const EncodeOptions options{.grid_only = grid_only, .cube_size = 8};
    const double estimated = estimate(options, {2}).estimates[0].file_bytes;
    const EncodeResult encoded = encode(options, 2);
    EXPECT_EQ(encoded.index.members.size(), grid_only ? 0U : 1U);
    EXPECT_NEAR(estimated / static_cast<double>(encoded.file_bytes), 1, 0.01);
  }
}

// Of a larger one, a sample is encoded.
TEST_F(EstimatedVolume, OfALargeVolumeAreWithinFivePerCent) {
  make_phantom({330, 300, 280}, SampleType::int16, 3);
  const std::vector<double> errors = {0, 5, 60};
  const EstimateResult result = estimate({}, errors);
  EXPECT_LT(result.encoded, result.bricks * 3 / 4);
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const EncodeResult encoded = encode({}, errors[i]);
    EXPECT_NEAR(result.estimates[i].file_bytes / static_cast<double>(encoded.file_bytes), 1, 0.05);
    const Achieved achieved = achieved_of(encoded.index.total);
    EXPECT_NEAR(result.estimates[i].rmse, achieved.rmse, 0.1 * achieved.rmse);
  }
}

TEST_F(EstimatedVolume, TheSameForAnyNumberOfThreads) {
  const Index3 dims = {60, 70, 80};
  write_nrrd(in_, dims, blobs<float>(dims, 2));
  const EstimateResult one = estimate({}, {}, 1), three = estimate({}, {}, 3);
  EXPECT_EQ(one.noise, three.noise);
  ASSERT_EQ(one.estimates.size(), three.estimates.size());
  EXPECT_GE(one.estimates.size(), 4U) << "a list of bounds by default";
  for (std::size_t i = 0; i < one.estimates.size(); ++i) {
    EXPECT_EQ(one.estimates[i].max_error, three.estimates[i].max_error);
    EXPECT_EQ(one.estimates[i].file_bytes, three.estimates[i].file_bytes);
    EXPECT_EQ(one.estimates[i].rmse, three.estimates[i].rmse);
  }
}

TEST_F(EstimatedVolume, ALimitOnMemoryIsKeptOrRefused) {
  const Index3 dims = {60, 70, 80};
  write_nrrd(in_, dims, blobs<std::int16_t>(dims, 2));
  Resources little(4);
  little.memory = std::uint64_t{1} << 20;
  EXPECT_THROW(estimate_encoding({.input = in_, .resources = little}), MemoryLimit);
  little.memory = memory_of_estimating(settled({}).parameters(), 1, 8, 12);
  EXPECT_NO_THROW(estimate_encoding({.input = in_, .resources = little}));
}

TYPED_TEST(EstimatesOfType, NoiseAndRangeGiveBounds) {
  const Index3 dims = {80, 70, 20};
  write_nrrd(this->in_, dims, blobs<TypeParam>(dims, 1, 20));
  const double noise = noise_of(*open_volume(this->in_)).deviation;
  EXPECT_NEAR(noise, 20 / std::sqrt(12.0), 0.4);
  const auto whole = [](double bound) { return std::is_integral_v<TypeParam> ? std::floor(bound) : bound; };
  const EncodeJob by_noise = this->settled(this->rule(ErrorRule::Kind::noise, 1.5));
  EXPECT_EQ(by_noise.parameters().max_error, whole(1.5 * noise));
  EXPECT_TRUE(has(by_noise.reason_of_bound, "noise"));
  const auto samples = read_samples<TypeParam>(this->in_);
  const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
  EXPECT_EQ(this->bound_of(this->rule(ErrorRule::Kind::relative, 0.1)),
            whole(0.1 * (static_cast<double>(*high) - static_cast<double>(*low))));
  EncodeOptions none{.max_error = 3};
  EXPECT_EQ(this->bound_of(none), 3);
  EXPECT_EQ(this->settled(none).reason_of_bound, "");
}

TYPED_TEST(EstimatesOfType, APsnrIsReachedByTheLoosestBound) {
  const Index3 dims = {50, 41, 37};
  write_nrrd(this->in_, dims, blobs<TypeParam>(dims, 1));
  for (const double wanted : {25.0, 40.0, 47.5}) {
    const EncodeOptions options = this->rule(ErrorRule::Kind::psnr, wanted);
    if (this->settled(options).parameters().transform_step > 0) continue;  // see the next test
    const double bound = this->bound_of(options);
    EXPECT_EQ(this->settled(options, 1).parameters().max_error, bound);
    const auto psnr = [&](double max_error) {
      const Achieved achieved = achieved_of(this->encode(options, max_error).index.total);
      return achieved.rmse > 0 ? achieved.psnr : INFINITY;
    };
    EXPECT_GE(psnr(bound), wanted);
    // The next one that is tried does not reach it; of floats that is 0.5 % more, but for rounding.
    if (std::is_integral_v<TypeParam>)
      EXPECT_LT(psnr(bound + 1), wanted);
    else
      EXPECT_LT(psnr(1.005 * bound), wanted + 0.02);
  }
}

// At low rates, samples are transformed. The promise holds, also of a bound besides it; the bytes are the same for
// any number of threads, and the file says what it has.
TYPED_TEST(EstimatesOfType, ATransformReachesAPsnr) {
  this->make_phantom({50, 41, 37}, sample_type_of<TypeParam>());
  for (const double wanted : {30.0, 40.0}) {
    EncodeOptions options = this->rule(ErrorRule::Kind::psnr, wanted);
    const EncodeResult free = this->encoded(options);
    EXPECT_GT(free.header.parameters.transform_step, 0);
    const Achieved achieved = achieved_of(free.index.total);
    EXPECT_GE(achieved.psnr, wanted);
    EXPECT_LT(achieved.psnr, wanted + 0.5);
    // Numbers of floats are rounded, so that some may be corrected that would have been within the bound.
    if (std::is_integral_v<TypeParam>)
      EXPECT_EQ(achieved.max_error, free.header.parameters.max_error);
    else
      EXPECT_LE(achieved.max_error, free.header.parameters.max_error);
    encode_volume(this->in_, {}, this->path("b.tag"), true, options, Resources(1));
    EXPECT_TRUE(file_content(this->path("a.tag")) == file_content(this->path("b.tag")));
    const VerifyResult verified = verify_file(this->path("a.tag"), this->in_, {}, Resources(2));
    EXPECT_EQ(verified.max_error, achieved.max_error);
    for (const double part : {0.9, 0.5, 0.1}) {
      options.max_error = kept_bound(part * achieved.max_error, sample_type_of<TypeParam>());
      const EncodeResult both =
          encode_volume(this->in_, {}, this->path("b.tag"), true, options, Resources(2));
      const Achieved of_both = achieved_of(both.index.total);
      EXPECT_LE(of_both.max_error, *options.max_error);
      EXPECT_TRUE(of_both.rmse == 0 || of_both.psnr >= wanted);
    }
  }
}

// What is asked is a small file: a bound that reaches the PSNR is not smaller, nor is a file of a higher PSNR.
TYPED_TEST(EstimatesOfType, AFileOfAPsnrIsNoLargerThanOneOfABoundThatReachesIt) {
  const Index3 dims = {70, 61, 40};
  write_nrrd(this->in_, dims, blobs<TypeParam>(dims, 1, 3));
  std::uint64_t before = 0;
  for (const double wanted : {30.0, 34.0, 38.0, 42.0, 46.0}) {
    const EncodeOptions options = this->rule(ErrorRule::Kind::psnr, wanted);
    this->encoded(options);
    const std::uint64_t bytes = std::filesystem::file_size(this->path("a.tag"));
    EXPECT_GE(1.02 * static_cast<double>(bytes), before) << wanted;
    before = bytes;
    for (double bound = 1; bound < 100; bound *= 1.5) {
      const EncodeResult result = this->encode(options, std::floor(bound));
      const Achieved a = achieved_of(result.index.total);
      if (a.rmse > 0 && a.psnr < wanted) continue;
      EXPECT_LE(static_cast<double>(bytes), 1.03 * static_cast<double>(result.file_bytes))
          << wanted << ' ' << bound;
    }
  }
}

// A size is reached from below, by at most 2 %, or with a better PSNR than that of a wavelet; no bound that fits is
// better.
TYPED_TEST(EstimatesOfType, ASizeIsReachedWithTheBestPsnr) {
  this->make_phantom({96, 90, 80}, sample_type_of<TypeParam>());
  const double voxels = 96 * 90 * 80, kept_of_source = 300;
  for (const double bits : {0.3, 1.0}) {
    const bool as_ratio = bits == 1;
    const EncodeOptions options = as_ratio ? this->rule(ErrorRule::Kind::ratio, 8 * sizeof(TypeParam) / bits)
                                           : this->rule(ErrorRule::Kind::bits, bits);
    const EncodeResult result = this->encoded(options);
    EXPECT_EQ(result.header.parameters.grid, GridOrigin::derived);
    const auto bytes = static_cast<double>(result.file_bytes), wanted = bits * voxels / 8;
    EXPECT_LT(bytes, wanted + kept_of_source);
    if (result.header.parameters.transform_step > 0) {
      EXPECT_GT(bytes, 0.97 * wanted) << bits;
    }
    const Achieved achieved = achieved_of(result.index.total);
    if (achieved.rmse == 0) continue;
    EncodeOptions derived;
    derived.grid = GridOrigin::derived;
    for (double bound = 1; bound < 2000; bound *= 1.7) {
      const EncodeResult bounded = this->encode(derived, std::floor(bound));
      if (static_cast<double>(bounded.file_bytes) > wanted) continue;
      EXPECT_LT(achieved_of(bounded.index.total).psnr, achieved.psnr + 0.2) << bits << ' ' << bound;
      break;
    }
  }
}

// Bricks of which none is transformed, as their values span too much.
TEST_F(EstimatedVolume, ASizeIsReachedWhereValuesHaveLongTails) {
  const Index3 dims = {48, 48, 48};
  std::mt19937 random(1);
  std::lognormal_distribution<float> values(0, 6);
  std::vector<float> samples(static_cast<std::size_t>(Box::of_size(dims).count()));
  for (float& sample : samples) sample = values(random);
  write_nrrd(in_, dims, samples);
  for (const double bits : {0.5, 2.0, 5.0}) {
    const EncodeResult result =
        encode_volume(in_, {}, path("a.tag"), true, rule(ErrorRule::Kind::bits, bits), Resources(2));
    const double voxels = 48 * 48 * 48, kept_of_source = 300;
    EXPECT_LT(static_cast<double>(result.file_bytes), bits * voxels / 8 + kept_of_source) << bits;
  }
}

TEST_F(EstimatedVolume, ASizeBelowThatOfAnyFileIsRefused) {
  const Index3 dims = {50, 40, 30};
  write_nrrd(in_, dims, blobs<std::int16_t>(dims, 1, 20));
  EXPECT_THROW(bound_of(rule(ErrorRule::Kind::ratio, 1e6)), UsageError);
  EXPECT_EQ(bound_of(rule(ErrorRule::Kind::bits, 20)), 0) << "a file that keeps all fits";
}

// With a PSNR or a size, an estimate is of what `encode` does.
TYPED_TEST(EstimatesOfType, OfAPsnrAndASizeAreThoseOfTheFiles) {
  this->make_phantom({90, 80, 70}, sample_type_of<TypeParam>());
  const std::vector<ErrorRule> rules = {{ErrorRule::Kind::psnr, 40}, {ErrorRule::Kind::bits, 0.5}};
  EstimateRun run{.input = this->in_, .rules = rules, .resources = Resources(2)};
  const EstimateResult result = estimate_encoding(run);
  ASSERT_EQ(result.estimates.size(), rules.size());
  for (std::size_t i = 0; i < rules.size(); ++i) {
    EncodeOptions options;
    options.error_rule = rules[i];
    const EncodeResult encoded = this->encoded(options);
    const Estimate& e = result.estimates[i];
    EXPECT_EQ(e.max_error, encoded.header.parameters.max_error);
    EXPECT_EQ(e.transform_step, encoded.header.parameters.transform_step);
    EXPECT_NEAR(e.file_bytes / static_cast<double>(encoded.file_bytes), 1, 0.03);
    EXPECT_NEAR(e.psnr, achieved_of(encoded.index.total).psnr, 0.05);
  }
}

TYPED_TEST(EstimatesOfType, MasksAreExactUnlessHardlyAnythingIsAsked) {
  const Index3 dims = {40, 41, 42};
  std::vector<TypeParam> mask(static_cast<std::size_t>(Box::of_size(dims).count()));
  for (const auto [x, y, z] : points_of(dims))
    mask[static_cast<std::size_t>(Box::of_size(dims).offset({x, y, z}))] =
        (x - 20) * (x - 20) + (y - 20) * (y - 20) + (z - 20) * (z - 20) < 250
            ? static_cast<TypeParam>(std::is_integral_v<TypeParam> ? std::numeric_limits<TypeParam>::max()
                                                                   : 1000)
            : 0;
  write_nrrd(this->in_, dims, mask);
  for (const double wanted : {5.0, 10.0, 40.0}) {
    const EncodeOptions options = this->rule(ErrorRule::Kind::psnr, wanted);
    const Achieved achieved = achieved_of(this->encoded(options).index.total);
    EXPECT_TRUE(achieved.rmse == 0 || achieved.psnr >= wanted);
    if (wanted < 20) continue;
    EXPECT_EQ(achieved.rmse, 0);
  }
}

// Whatever the number, the search ends, and the promise holds.
TYPED_TEST(EstimatesOfType, AnyPsnrIsFoundOrIsLossless) {
  const Index3 dims = {20, 17, 9};
  const auto samples = blobs<TypeParam>(dims, 1);
  for (const auto& volume : {samples, std::vector<TypeParam>(samples.size(), TypeParam{7})}) {
    write_nrrd(this->in_, dims, volume);
    for (const double wanted : {1e-3, 10.0, 120.0, 400.0, 1e4, 1e9}) {
      const EncodeOptions options = this->rule(ErrorRule::Kind::psnr, wanted);
      const Achieved achieved = achieved_of(this->encoded(options).index.total);
      if (achieved.rmse > 0) {
        EXPECT_GE(achieved.psnr, wanted);
      }
    }
  }
}

TEST_F(EstimatedVolume, SamplesThatAreNotFiniteHaveNoRange) {
  const Index3 dims = {9, 8, 7};
  const auto count = static_cast<std::size_t>(Box::of_size(dims).count());
  write_nrrd(in_, dims, std::vector<float>(count, NAN));
  for (const auto kind : {ErrorRule::Kind::noise, ErrorRule::Kind::relative, ErrorRule::Kind::psnr})
    EXPECT_EQ(bound_of(rule(kind, 2)), 0);
  write_nrrd(in_, dims, std::vector<float>(count, 5));
  EXPECT_EQ(bound_of(rule(ErrorRule::Kind::relative, 2)), 0) << "a constant volume has no range";
  std::vector<double> wide(count, 0);
  wide[0] = -std::numeric_limits<double>::max();
  wide[1] = std::numeric_limits<double>::max();
  write_nrrd(in_, dims, wide);
  EXPECT_THROW(bound_of(rule(ErrorRule::Kind::psnr, 50)), UsageError);
  EXPECT_TRUE(std::isfinite(bound_of(rule(ErrorRule::Kind::relative, 3))));
}

TEST_F(EstimatedVolume, RowsAreSpreadWithoutAPeriod) {
  for (const std::int64_t rows : {1, 7, 128, 256, 1000})
    for (const std::int64_t wanted : {std::int64_t{1}, rows / 8 + 1, rows}) {
      std::set<std::int64_t> chosen, places;
      for (std::int64_t i = 0; i < wanted; ++i) {
        const std::int64_t row = spread_row(i, wanted, rows);
        EXPECT_TRUE(row >= 0 && row < rows);
        chosen.insert(row);
        places.insert(row % 8);
      }
      EXPECT_EQ(static_cast<std::int64_t>(chosen.size()), wanted);
      if (wanted >= 16) {
        EXPECT_GE(places.size(), 6U);
      }
    }
}

// Every other option that says what is kept has a list of bounds by default.
TEST_F(EstimatedVolume, TheUsualBoundsFitTheOtherOptions) {
  const Index3 dims = {30, 31, 17};
  write_nrrd(in_, dims, blobs<std::int16_t>(dims, 1, 20));
  std::vector<EncodeOptions> all(5);
  all[0].surface_error = 1;
  all[1].mesh_error = 3;
  all[2].grid_only = true;
  all[3].grid_only = true;
  all[3].max_level = 6;
  all[4].surface_error = 1000;
  for (EncodeOptions& options : all) {
    options.cube_size = 8;
    const EstimateResult result = estimate(options, {});
    ASSERT_FALSE(result.estimates.empty());
    for (const Estimate& e : result.estimates) {
      EncodeOptions same = options;
      if (e.max_error >= 0) same.max_error = e.max_error;
      const EncodeResult encoded = encode_volume(in_, {}, path("a.tag"), true, same, Resources(1));
      EXPECT_NEAR(e.file_bytes / static_cast<double>(encoded.file_bytes), 1, 0.03);
    }
  }
  EXPECT_THROW(estimate({}, std::vector<double>(65, 1)), UsageError) << "too many bounds at once";
}

TEST_F(EstimatedVolume, RulesThatContradictOtherOptionsAreRefused) {
  using Kind = ErrorRule::Kind;
  EXPECT_NO_THROW(rule(Kind::psnr, 40).validate());
  for (const Kind kind : {Kind::noise, Kind::relative, Kind::psnr}) {
    for (const double value : {0.0, -1.0, std::nan(""), HUGE_VAL})
      EXPECT_THROW(rule(kind, value).validate(), UsageError) << value;
    EncodeOptions both = rule(kind, 1);
    both.max_error = 2;
    if (kind == Kind::psnr)
      EXPECT_NO_THROW(both.validate());
    else
      EXPECT_THROW(both.validate(), UsageError);
    EncodeOptions limited = rule(kind, 1);
    limited.grid_only = true;
    limited.max_level = 3;
    EXPECT_THROW(limited.validate(), UsageError);
  }
  EncodeOptions grid = rule(Kind::psnr, 40), surface = rule(Kind::psnr, 40);
  grid.grid_only = true;
  surface.surface_error = 1;
  EXPECT_THROW(grid.validate(), UsageError);
  EXPECT_THROW(surface.validate(), UsageError);
  // A bound of the mesh below that of the voxels is found as soon as that is known.
  const Index3 dims = {40, 40, 20};
  write_nrrd(in_, dims, blobs<std::int16_t>(dims, 1, 20));
  EncodeOptions mesh = rule(Kind::noise, 2);
  mesh.mesh_error = 3;
  EXPECT_NO_THROW(mesh.validate());
  EXPECT_THROW(encode_volume(in_, {}, path("a.tag"), true, mesh, Resources(1)), UsageError);
  EXPECT_FALSE(std::filesystem::exists(path("a.tag")));
}

// With these rules and any other option that a user may add, the promise of each holds.
TEST_F(EstimatedVolume, RulesHoldTogetherWithOtherOptions) {
  const Index3 dims = {40, 41, 37};
  write_nrrd(in_, dims, blobs<std::int16_t>(dims, 1, 20));
  for (int i = 0; i < 5; ++i) {
    EncodeOptions options = rule(ErrorRule::Kind::noise, 1.2);
    if (i == 1) options.grid_only = true;
    if (i == 2) options.surface_error = 1;
    if (i == 3) options.mesh_error = 12;
    if (i == 4) options.grid = GridOrigin::derived;
    const EncodeResult result = encode_volume(in_, {}, path("a.tag"), true, options, Resources(2));
    EXPECT_EQ(result.header.parameters.max_error, std::floor(1.2 * noise_of(*open_volume(in_)).deviation));
    const VerifyResult verified = verify_file(path("a.tag"), in_, {}, Resources(1));
    EXPECT_LE(*verified.max_error, result.header.parameters.max_error);
    if (i == 3) {
      EXPECT_LE(*verified.mesh_error, 12);
    }
  }
}

}  // namespace
}  // namespace tagrid
