// The entropy coder and the model of its symbols.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "stages/entropy/rans_coder.h"
#include "stages/entropy/symbol_model.h"

namespace tagrid {
namespace {

struct Decision {
  std::uint32_t value = 0;
  std::uint32_t p = 0;  ///< 0: raw
  int bits = 0;
};

std::vector<Decision> any_decisions() {
  const auto count = *rc::gen::inRange<std::size_t>(0, 400);
  std::vector<Decision> decisions(count);
  for (Decision& d : decisions) {
    if (*rc::gen::inRange(0, 4) == 0) {
      d.bits = *rc::gen::inRange(0, 17);
      d.value = *rc::gen::inRange<std::uint32_t>(0, std::uint32_t{1} << d.bits);
    } else {
      d.p = *rc::gen::element<std::uint32_t>(1, 2, 100, 32768, 65000, 65534, 65535);
      d.value = *rc::gen::inRange<std::uint32_t>(0, 2);
    }
  }
  return decisions;
}

template <class Coder>
std::uint32_t pass(Coder& coder, const Decision& d) {
  return d.p == 0 ? coder.code_raw(d.value, d.bits) : coder.code(d.value != 0, d.p);
}

std::vector<std::uint8_t> encoded(const std::vector<Decision>& decisions) {
  std::vector<std::uint8_t> bytes = {255, 255};  // earlier content stays
  RansEncoder encoder(bytes);
  for (const Decision& d : decisions) pass(encoder, d);
  encoder.finish();
  EXPECT_EQ(bytes[0], 255);
  EXPECT_EQ(bytes[1], 255);
  return {bytes.begin() + 2, bytes.end()};
}

RC_GTEST_PROP(RansCoder, DecodesWhatWasEncodedAndUsesEveryByte, ()) {
  const auto decisions = any_decisions();
  const auto bytes = encoded(decisions);
  RansDecoder decoder(bytes);
  for (const Decision& d : decisions) RC_ASSERT(pass(decoder, d) == d.value);
  RC_ASSERT(decoder.finished());
}

TEST(RansCoder, EveryIntervalComesBackWhateverTheState) {
  std::vector<Decision> decisions;
  for (int i = 0; i < 5000; ++i) decisions.push_back({0, 65535, 0});
  for (int i = 0; i < 5000; ++i) decisions.push_back({i % 3 == 0, 1u + 65533u * (i % 2), 0});
  const auto bytes = encoded(decisions);
  RansDecoder decoder(bytes);
  for (const Decision& d : decisions) ASSERT_EQ(pass(decoder, d), d.value);
  EXPECT_TRUE(decoder.finished());
}

TEST(RansCoder, ReciprocalsDivideEveryStateExactly) {
  const Reciprocals reciprocals;
  std::uint64_t random = 1;
  for (std::uint64_t length = 1; length < 65536; ++length)
    for (int i = 0; i < 16; ++i) {
      random = random * 6364136223846793005u + 1442695040888963407u;
      const std::uint64_t largest = ((rans_low << 16) - length) / length;
      const std::uint64_t quotient = i == 0 ? largest : (random >> 13) % (largest + 1);
      ASSERT_EQ(reciprocals.divide(quotient * length, length), quotient);
      ASSERT_EQ(reciprocals.divide(quotient * length + length - 1, length), quotient);
    }
}

TEST(RansCoder, CostsWhatTheProbabilitySays) {
  std::vector<Decision> decisions(100000, Decision{1, 65535, 0});
  EXPECT_LE(encoded(decisions).size(), 8u);
  decisions.assign(8000, Decision{1, 32768, 0});
  EXPECT_NEAR(static_cast<double>(encoded(decisions).size()), 1000, 8);
}

TEST(RansCoder, EveryNumberOfEventsComesBackAroundTheEndsOfChunks) {
  constexpr std::size_t chunk = RansEncoder::chunk_size;
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, chunk - 1, chunk, chunk + 1, 2 * chunk - 1,
                                  2 * chunk, 2 * chunk + 1, 5 * chunk}) {
    std::vector<Decision> decisions;
    for (std::uint32_t i = 0; i < count; ++i) decisions.push_back({i % 3 == 0, 1 + i % 1000 * 65, 0});
    const auto bytes = encoded(decisions);
    RansDecoder decoder(bytes);
    for (const Decision& d : decisions) ASSERT_EQ(pass(decoder, d), d.value) << count;
    EXPECT_TRUE(decoder.finished()) << count;
  }
}

TEST(RansCoder, TellsMissingAndTrailingBytes) {
  std::vector<Decision> decisions;
  for (std::uint32_t i = 0; i < 300; ++i) decisions.push_back({i % 2, 32768, 0});
  const auto bytes = encoded(decisions);
  for (const std::ptrdiff_t change : {-8, -4, -2, -1, 1, 2, 4}) {
    auto other = bytes;
    other.resize(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(bytes.size()) + change));
    RansDecoder decoder(other);
    for (const Decision& d : decisions) pass(decoder, d);
    EXPECT_FALSE(decoder.finished()) << change;
    EXPECT_EQ(decoder.exhausted(), change < 0) << change;
  }
}
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

// As section 5.6 of docs/dev/format.md has it.
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
