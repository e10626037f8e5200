#include "stages/entropy/symbol_model.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

namespace tagrid {
namespace {

SymbolModel any_start() {
  return geometric_model(*rc::gen::inRange<std::uint64_t>(0, 70000),
                         *rc::gen::inRange<std::uint64_t>(1, 20000));
}

void expect_valid(const SymbolModel& model) {
  for (std::size_t s = 1; s < symbol_count; ++s) {
    const int before = s == 1 ? 0 : model.below[s - 1];
    RC_ASSERT(model.below[s] - before >= SymbolTargets::least);
  }
  RC_ASSERT(32768 - model.below[15] >= SymbolTargets::least);
}

// As section 5.6 of docs/format.md has it.
void learn(SymbolModel& model, std::size_t symbol) {
  const int rate = learning_rates[static_cast<std::size_t>(model.below[0] / 1024)];
  for (std::size_t i = 0; i < symbol_count; ++i) {
    const int move = (symbol_targets.of[symbol][i] - model.below[i]) >> rate;
    model.below[i] = static_cast<std::int16_t>(model.below[i] + move);
  }
}

RC_GTEST_PROP(SymbolModel, EverySymbolKeepsItsLeastProbability, (const std::vector<std::uint8_t>& observed)) {
  SymbolModel model = any_start();
  expect_valid(model);
  for (const std::uint8_t symbol : observed)
    for (int times = 0; times < 40; ++times) {
      learn(model, symbol % symbol_count);
      expect_valid(model);
    }
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
