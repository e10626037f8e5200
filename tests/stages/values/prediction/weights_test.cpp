#include "stages/values/prediction/weights.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/points.h"

namespace tagrid {
namespace {

template <class T, class F>
std::vector<T> volume(Index3 size, F&& f) {
  std::vector<T> samples;
  for (const auto [x, y, z] : points_of(size)) samples.push_back(static_cast<T>(f(x, y, z)));
  return samples;
}

/// Mean squared error of the weights over the voxels that have all neighbours.
template <class T>
double mean_square(const std::vector<T>& samples, Index3 size, const Weights& w, double reference) {
  double total = 0, count = 0;
  for (std::int64_t z = 2; z < size.z; ++z)
    for (std::int64_t y = 2; y + 1 < size.y; ++y)
      for (std::int64_t x = 2; x + 2 < size.x; ++x, ++count) {
        const auto at = [&](Tap t) {
          return samples[static_cast<std::size_t>(((z + t.dz) * size.y + y + t.dy) * size.x + x + t.dx)] -
                 reference;
        };
        double error = -at({0, 0, 0});
        for (std::size_t i = 0; i < taps.size(); ++i) error += w.of_tap[i] * at(taps[i]) / (1 << weight_bits);
        total += error * error;
      }
  return total / count;
}

std::uint32_t scrambled(std::int64_t i) {
  auto v = static_cast<std::uint32_t>(i) * 2654435761u;
  v ^= v >> 15;
  v *= 2246822519u;
  return v ^ v >> 13;
}

TEST(Prediction, TapsComeBeforeTheVoxelInRasterOrder) {
  for (const Tap& t : taps) EXPECT_TRUE(t.dz < 0 || (t.dz == 0 && (t.dy < 0 || (t.dy == 0 && t.dx < 0))));
}

TEST(Prediction, FindsTheSliceBehindWhereItIsTheBestNeighbour) {
  const Index3 size{24, 24, 20};
  const auto samples = volume<std::int16_t>(
      size, [](auto x, auto y, auto z) { return int(scrambled(y * 24 + x) % 1000) + 3 * z; });
  const Weights w = fit_weights<std::int16_t>(samples, size, all_taps, 500, 600, 0);
  EXPECT_LT(mean_square(samples, size, w, 500), 50);
  EXPECT_GT(mean_square(samples, size, default_weights(), 500), 10000);
}

TEST(Prediction, IsNeverFarWorseThanTheDefault) {
  const Index3 size{24, 24, 20};
  for (const int amplitude : {1, 2, 50, 60000}) {
    const auto samples = volume<std::uint16_t>(size, [amplitude](auto x, auto y, auto z) {
      return scrambled((z * 24 + y) * 24 + x) % static_cast<unsigned>(amplitude + 1);
    });
    for (const double noise : {0.0, 2.0, 800.0}) {
      const Weights w = fit_weights<std::uint16_t>(samples, size, all_taps, amplitude / 2, amplitude, noise);
      EXPECT_LT(mean_square(samples, size, w, amplitude / 2),
                1.1 * mean_square(samples, size, default_weights(), amplitude / 2) + 0.1);
    }
  }
}

TEST(Prediction, WeightsKeepToTheLimitThatSumsRelyOn) {
  const Index3 size{20, 20, 20};
  const auto samples = volume<std::int16_t>(size, [](auto x, auto y, auto z) {
    return 30000 * ((x * x + y * y + z * z) % 2 ? 1 : -1) + (x * y * z) % 7;
  });
  EXPECT_LE(fit_weights<std::int16_t>(samples, size, all_taps, 0, 32768, 0).magnitude(), weight_limit);
  EXPECT_LE(fit_weights<std::int16_t>(samples, size, slice_taps, 0, 32768, 0).magnitude(), weight_limit);
}

// Small numbers are added up in integers of 32 bits, others in doubles; both are exact.
TEST(Prediction, SumsInIntegersAndInDoublesGiveTheSameWeights) {
  for (const Index3 size : {Index3{1, 1, 2}, Index3{3, 40, 5}, Index3{67, 20, 33}, Index3{130, 19, 3}})
    for (const int amplitude : {1, 100, 8191}) {
      const auto samples = volume<std::int16_t>(size, [&](auto x, auto y, auto z) {
        return static_cast<int>(scrambled((z * 99 + y) * 99 + x) % static_cast<unsigned>(2 * amplitude + 1)) -
               amplitude;
      });
      for (const int tap_count : {slice_taps, all_taps}) {
        const Weights w = fit_weights<std::int16_t>(samples, size, tap_count, 0, amplitude, 1);
        EXPECT_EQ(w, fit_weights<std::int16_t>(samples, size, tap_count, 0, 32767, 1)) << amplitude;
      }
    }
}

TEST(Prediction, FlatVolumeGetsTheDefault) {
  const std::vector<std::uint8_t> samples(1000, 7);
  EXPECT_EQ(fit_weights<std::uint8_t>(samples, {10, 10, 10}, all_taps, 7, 0, 0), default_weights());
}

}  // namespace
}  // namespace tagrid
