#include "stages/survey/survey.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/support/points.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

// A box that does not begin at the origin, with a smooth field and noise.
template <class T>
std::vector<T> noisy(const Box& box, double deviation, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, deviation);
  std::vector<T> samples;
  for (const auto [x, y, z] : points_of(box)) {
    const double field = 60 + 0.2 * static_cast<double>(x) - 0.1 * static_cast<double>(y) +
                         20 * static_cast<double>(z % 2);  // slices have nothing in common
    const double v = field + (deviation > 0 ? noise(random) : 0);
    samples.push_back(std::is_integral_v<T> ? static_cast<T>(std::lround(v)) : static_cast<T>(v));
  }
  return samples;
}

template <class T>
struct Survey : testing::Test {
  static double noise_of(const Box& box, const std::vector<T>& samples) {
    std::vector<double> deviations;
    append_deviations(Samples<T>{box, samples.data()}, deviations);
    return usual_deviation(deviations);
  }
};
TYPED_TEST_SUITE(Survey, AllTypes);

TYPED_TEST(Survey, FindsTheNoiseOfASmoothField) {
  const Box box{{3, 5, 7}, {90, 80, 30}};
  for (const double deviation : {2.0, 5.0, 11.0})
    // Rounding to whole numbers is noise, too.
    EXPECT_NEAR(this->noise_of(box, noisy<TypeParam>(box, deviation, 1)),
                std::sqrt(deviation * deviation + (std::is_integral_v<TypeParam> ? 1.0 / 12 : 0)),
                0.03 * deviation);
}

TYPED_TEST(Survey, EdgesAreNoNoise) {
  const Box box{{0, 0, 0}, {99, 99, 20}};
  auto samples = noisy<TypeParam>(box, 3, 2);
  // Half of the blocks have an edge of some height in them.
  for (const auto [x, y, z] : points_of(Box{{}, box.high}))
    if ((x / 16 + y / 16) % 2 == 0 && x % 8 > 3)
      samples[static_cast<std::size_t>(box.offset({x, y, z}))] += static_cast<TypeParam>(5 + (x * y) % 60);
  EXPECT_NEAR(this->noise_of(box, samples), 3, 0.3);
}

TEST(Noise, IsDoubtfulIfManyBlocksAreFarCalmer) {
  std::vector<double> deviations(100, 200.0);
  EXPECT_FALSE(is_doubtful(200, deviations));
  std::fill_n(deviations.begin(), 16, 8.0);
  EXPECT_FALSE(is_doubtful(200, deviations));
  std::fill_n(deviations.begin(), 17, 8.0);
  EXPECT_TRUE(is_doubtful(200, deviations));
  EXPECT_FALSE(is_doubtful(8, deviations));
  EXPECT_FALSE(is_doubtful(0, {}));
}

TYPED_TEST(Survey, WithoutNoiseThereIsNone) {
  const Box box{{0, 0, 0}, {30, 30, 3}};
  const auto count = static_cast<std::size_t>(box.count());
  EXPECT_EQ(this->noise_of(box, std::vector<TypeParam>(count, TypeParam{7})), 0);
  for (const Box& thin : {Box{{0, 0, 0}, {0, 0, 0}}, Box{{0, 0, 0}, {1, 0, 0}}, Box{{0, 0, 0}, {0, 0, 50}}})
    EXPECT_EQ(this->noise_of(thin, noisy<TypeParam>(thin, 5, 1)), 0) << "too few samples to tell";
}

TYPED_TEST(Survey, BlocksWithSamplesThatAreNotFiniteAreLeftOut) {
  if constexpr (std::is_floating_point_v<TypeParam>) {
    const Box box{{0, 0, 0}, {79, 79, 9}};
    auto samples = noisy<TypeParam>(box, 3, 2);
    for (std::size_t i = 0; i < samples.size(); i += 173)
      samples[i] =
          i % 2 ? std::numeric_limits<TypeParam>::quiet_NaN() : -std::numeric_limits<TypeParam>::infinity();
    const double noise = this->noise_of(box, samples);
    EXPECT_NEAR(noise, 3, 0.2);
  }
}

TYPED_TEST(Survey, RoughnessIsItsDefinition) {
  const Box box{{2, 3, 1}, {40, 12, 6}};
  const auto samples = noisy<TypeParam>(box, 6, 3);
  const std::vector<double> steps = {1, 5, 41};
  const std::vector<double> bits = roughness(Samples<TypeParam>{box, samples.data()}, steps);
  const auto at = [&](Index3 p) {
    return static_cast<double>(samples[static_cast<std::size_t>(box.offset(p))]);
  };
  for (std::size_t i = 0; i < steps.size(); ++i) {
    double expected = 0;
    for (const auto [x, y, z] : points_of(box)) {
      if (x == box.low.x || y == box.low.y || z == box.low.z) continue;
      const double mean = (at({x - 1, y, z}) + at({x, y - 1, z}) + at({x, y, z - 1})) / 3;
      expected += std::log2(1 + std::abs(at({x, y, z}) - mean) / steps[i]);
    }
    // The low faces have fewer neighbours, and logarithms are taken as pieces of lines.
    EXPECT_GT(bits[i], 0.9 * expected);
    EXPECT_LT(bits[i], 1.6 * expected + 1);
  }
  EXPECT_GT(bits[0], bits[1]);
  EXPECT_GT(bits[1], bits[2]);
  const std::vector<TypeParam> flat(samples.size(), TypeParam{9});
  EXPECT_EQ(roughness(Samples<TypeParam>{box, flat.data()}, steps), std::vector<double>(3));
}

}  // namespace
}  // namespace tagrid
