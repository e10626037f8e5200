#include "stages/values/best/running_least_squares.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

namespace tagrid {
namespace {

Features random_features(std::mt19937& random, std::int32_t amplitude) {
  Features f;
  for (auto& v : f)
    v = static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(2 * amplitude + 1)) - amplitude;
  return f;
}

// target = f[3] / 2 - f[7] / 4
std::int32_t target_of(const Features& f) { return (2 * f[3] - f[7]) / 4; }

template <class Model>
std::int64_t missed_after(Model model, int voxels) {
  std::mt19937 random(1);
  std::int64_t missed = 0;
  for (int i = 0; i < voxels; ++i) {
    const Features f = random_features(random, 100);
    const std::int64_t error = target_of(f) - (model.predict(f) >> Model::weight_bits);
    if constexpr (requires { model.learn(f, target_of(f)); } && Model::weight_bits == 16)
      model.learn(f, target_of(f));
    else
      model.learn(f, error);
    if (i >= voxels - 100) missed += std::abs(error);
  }
  return missed;
}

TEST(RunningLeastSquares, FindsALinearRelationInAFewHundredVoxels) {
  EXPECT_LE(missed_after(RunningLeastSquares(1), 500), 100 * 2);
}

TEST(GradientDescent, FindsALinearRelationMoreSlowly) {
  EXPECT_LE(missed_after(GradientDescent(320), 20000), 100 * 3);
}

// The content of a damaged stream: any features, any targets. Sums must stay within their types, which the
// sanitizers check, and predictions within the limits of weights.
TEST(RunningLeastSquares, ExtremesStayWithinTheirBits) {
  std::mt19937 random(2);
  for (const std::int64_t penalty : {std::int64_t{1}, std::int64_t{1} << 38})
    for (int kind = 0; kind < 4; ++kind) {
      RunningLeastSquares squares(penalty);
      GradientDescent gradient(1);
      for (int i = 0; i < 20000; ++i) {
        Features f = random_features(random, kind == 0 ? 1 : feature_limit);
        if (kind >= 2)
          for (auto& v : f) v = v < 0 ? -feature_limit : feature_limit;
        if (kind == 3) f.fill(i % 2 ? feature_limit : -feature_limit);
        const std::int32_t target = random() % 2 ? feature_limit : -feature_limit;
        EXPECT_LE(std::abs(squares.predict(f)), std::int64_t{features} * feature_limit * (8 << 16));
        EXPECT_LE(std::abs(gradient.predict(f)), std::int64_t{features} * feature_limit * (8 << 20));
        squares.learn(f, target);
        gradient.learn(f, target * 2);
      }
    }
}

}  // namespace
}  // namespace tagrid
