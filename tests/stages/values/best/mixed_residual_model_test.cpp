#include "stages/values/best/mixed_residual_model.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "stages/entropy/rans_coder.h"

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

}  // namespace
}  // namespace tagrid
