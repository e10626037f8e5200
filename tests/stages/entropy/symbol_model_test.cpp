#include "stages/entropy/symbol_model.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <random>

namespace tagrid {
namespace {

SymbolModel any_start() {
  return geometric_model(*rc::gen::inRange<std::uint64_t>(0, 70000),
                         *rc::gen::inRange<std::uint64_t>(1, 20000));
}

void expect_valid(const SymbolModel& model) {
  for (std::size_t s = 1; s < symbols; ++s) {
    const int before = s == 1 ? 0 : model.below[s - 1];
    RC_ASSERT(model.below[s] - before >= SymbolTargets::least);
  }
  RC_ASSERT(32768 - model.below[15] >= SymbolTargets::least);
}

RC_GTEST_PROP(SymbolModel, EverySymbolKeepsItsLeastProbability, (const std::vector<std::uint8_t>& observed)) {
  SymbolModel model = any_start();
  expect_valid(model);
  for (const std::uint8_t symbol : observed)
    for (int times = 0; times < 40; ++times) {
      learn(model, symbol % symbols);
      expect_valid(model);
    }
}

RC_GTEST_PROP(SymbolModel, SymbolsComeBackFromTheMeanOfAnyThreeModels,
              (const std::vector<std::uint8_t>& values)) {
  std::array<SymbolModel, 3> writers = {any_start(), any_start(), any_start()}, readers = writers;
  std::vector<std::uint8_t> bytes;
  RansEncoder encoder(bytes);
  for (const auto value : values) code_symbol(encoder, value % symbols, writers[0], writers[1], writers[2]);
  encoder.finish();
  RansDecoder decoder(bytes);
  for (const auto value : values)
    RC_ASSERT(code_symbol(decoder, 0, readers[0], readers[1], readers[2]) == value % symbols);
  RC_ASSERT(decoder.finished());
}

TEST(SymbolModel, LearnsADistributionUpToAFewPerCent) {
  const std::array<double, 4> p = {0.5, 0.25, 0.15, 0.1};
  double entropy = 0;
  for (const double q : p) entropy -= q * std::log2(q);
  std::mt19937 random(1);
  std::array<SymbolModel, 3> models;
  models.fill(geometric_model(1, 1));
  std::vector<std::uint8_t> bytes;
  RansEncoder encoder(bytes);
  constexpr int count = 40000;
  for (int i = 0; i < count; ++i) {
    const double u = static_cast<double>(random()) / 4294967296.0;
    code_symbol(encoder, u < p[0] ? 7 : u < 0.75 ? 8 : u < 0.9 ? 6 : 15, models[0], models[1], models[2]);
  }
  encoder.finish();
  EXPECT_LT(8.0 * static_cast<double>(bytes.size()) / count, 1.03 * entropy);
}

TEST(SymbolModel, AgeingIsFastFirstAndNeverStops) {
  SymbolModel model = geometric_model(1, 1);
  const auto probability_of_15 = [&model] { return 32768 - model.below[15]; };
  int last = probability_of_15();
  for (int i = 0; i < 200; ++i) {
    learn(model, 15);
    EXPECT_GE(probability_of_15(), last);
    last = probability_of_15();
  }
  EXPECT_GT(last, 31000);
  for (int i = 0; i < 200; ++i) learn(model, 7);
  EXPECT_LT(probability_of_15(), 2500);
}

}  // namespace
}  // namespace tagrid
