// Models of residuals and weights for the effort "best".
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cstdlib>
#include <random>
#include <vector>

#include "stages/entropy/rans_coder.h"
#include "stages/values/best/residual_model.h"
#include "stages/values/best/running_least_squares.h"

namespace tagrid {
namespace {

MixedContext any_context(std::mt19937& random) {
  MixedContext c;
  for (std::size_t i = 0; i < mixed_contexts; ++i)
    c.of[i] = static_cast<std::uint32_t>(random() % mixed_context_sizes[i]);
  c.energy = random() % 64;
  c.spread = random() % 256;
  c.low_bits = static_cast<std::int32_t>(random() % 11);
  return c;
}

TEST(MixedResidualModel, ResidualsOfAnySizeComeBackInAnyContext) {
  std::mt19937 random(4);
  constexpr std::int32_t largest = 65536;
  std::vector<MixedContext> contexts;
  std::vector<std::int32_t> residuals;
  for (int i = 0; i < 5000; ++i) {
    contexts.push_back(any_context(random));
    const auto size = static_cast<std::int32_t>(random() % (i % 3 == 0 ? 65537 : i % 3 == 1 ? 40 : 3));
    residuals.push_back(random() % 2 ? size : -size);
  }
  std::vector<std::uint8_t> bytes;
  {
    RansEncoder coder(bytes);
    MixedResidualModel model;
    for (std::size_t i = 0; i < residuals.size(); ++i)
      EXPECT_EQ(model.code(coder, residuals[i], largest, contexts[i]), residuals[i]);
    coder.finish();
  }
  RansDecoder coder(bytes);
  MixedResidualModel model;
  for (std::size_t i = 0; i < residuals.size(); ++i)
    ASSERT_EQ(model.code(coder, 0, largest, contexts[i]), residuals[i]) << i;
  EXPECT_TRUE(coder.finished());
}

TEST(MixedResidualModel, WhatOneContextOfEightKnowsCostsLittle) {
  std::mt19937 random(5);
  std::vector<std::uint8_t> bytes;
  RansEncoder coder(bytes);
  MixedResidualModel model;
  constexpr int count = 20000;
  for (int i = 0; i < count; ++i) {
    MixedContext c = any_context(random);
    c.low_bits = 0;
    c.energy = c.spread = 0;
    c.of[5] = random() % 2;
    model.code(coder, c.of[5] ? 1 : 0, 100, c);
  }
  coder.finish();
  EXPECT_LT(8.0 * static_cast<double>(bytes.size()) / count, 0.1);  // a bit each without the context
}
TEST(ResidualCoding, StretchIsTheInverseOfSquash) {
  for (std::size_t i = 1; i < 4096; ++i) {
    EXPECT_GE(squash_table[i], squash_table[i - 1]);
    EXPECT_GE(stretch_table[i], stretch_table[i - 1]);
  }
  EXPECT_NEAR(squash_table[2048], 32768, 1);
  for (std::size_t p = 16; p < 4080; ++p)
    EXPECT_NEAR(squash_table[static_cast<std::size_t>(stretch_table[p] + 2048)], p * 16 + 8, 80);
}

TEST(ResidualCoding, AdaptiveBitStaysWithinItsBits) {
  for (const bool bit : {false, true}) {
    AdaptiveBit model;
    for (int i = 0; i < 100000; ++i) model.learn(bit, 1000);
    EXPECT_EQ(model.probability() > 65000, bit);
    EXPECT_GE(model.probability(), 1u);
    EXPECT_LE(model.probability(), 65535u);
  }
}

RC_GTEST_PROP(ResidualCoding, IntegersComeBack, (std::vector<std::int64_t> values)) {
  for (auto& v : values) v %= std::int64_t{1} << 38;
  std::vector<std::uint8_t> bytes;
  RansEncoder encoder(bytes);
  IntegerModel writer, reader;
  for (const auto v : values) writer.code_signed(encoder, v);
  encoder.finish();
  RansDecoder decoder(bytes);
  for (const auto v : values) RC_ASSERT(reader.code_signed(decoder, 0) == v);
  RC_ASSERT(decoder.finished());
}

TEST(ResidualCoding, ClassesOfEnergyAgreeWithTheirMembers) {
  for (std::uint32_t energy = 0; energy <= 16 * 4095; ++energy) {
    const std::uint32_t in = log_scale<2>(energy);
    ASSERT_LT(in, energy_classes);
    const EnergyClass& size = energy_class_table[in];
    const std::uint32_t coarse = std::min<std::uint32_t>(log_scale<1>(energy), 15);
    ASSERT_EQ(size.of_8, coarse / 2) << energy;
    ASSERT_EQ(size.of_4, coarse / 4) << energy;
    ASSERT_EQ(size.low_bits, std::max(0, static_cast<int>(std::bit_width(energy >> 4)) - 2)) << energy;
  }
}
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
