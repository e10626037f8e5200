#include "stages/residual_coding.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <memory>

namespace tagrid {
namespace {

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
  RangeEncoder encoder(bytes);
  IntegerModel writer, reader;
  for (const auto v : values) writer.code_signed(encoder, v);
  encoder.finish();
  RangeDecoder decoder(bytes);
  for (const auto v : values) RC_ASSERT(reader.code_signed(decoder, 0) == v);
  RC_ASSERT(decoder.finished());
}

RC_GTEST_PROP(ResidualCoding, ResidualsOfAnySizeComeBackInAnyContext, ()) {
  struct Item {
    std::int64_t residual;
    ResidualContext context;
  };
  const std::int64_t largest = *rc::gen::element<std::int64_t>(1, 3, 255, 65535, (std::int64_t{1} << 33) - 1);
  std::vector<Item> items(*rc::gen::inRange<std::size_t>(0, 200));
  for (Item& item : items) {
    item.residual = *rc::gen::inRange<std::int64_t>(-largest, largest + 1);
    ResidualContext& c = item.context;
    for (std::size_t i = 0; i < c.magnitude.size(); ++i) {
      c.magnitude[i] = static_cast<std::uint16_t>(*rc::gen::inRange(0, magnitude_contexts[i]));
      c.sign[i] = static_cast<std::uint16_t>(*rc::gen::inRange(0, sign_contexts[i]));
    }
    c.mixer = static_cast<std::uint8_t>(*rc::gen::inRange(0, mixer_contexts));
    c.low_bits = static_cast<std::uint8_t>(*rc::gen::inRange(0, 20));
    c.flat = *rc::gen::inRange(0, 5) == 0;
  }
  std::vector<std::uint8_t> bytes;
  RangeEncoder encoder(bytes);
  const auto writer = std::make_unique<ResidualModel>(), reader = std::make_unique<ResidualModel>();
  for (const Item& item : items) writer->code(encoder, item.residual, largest, item.context);
  encoder.finish();
  RangeDecoder decoder(bytes);
  for (const Item& item : items) RC_ASSERT(reader->code(decoder, 0, largest, item.context) == item.residual);
  RC_ASSERT(decoder.finished());
}

}  // namespace
}  // namespace tagrid
