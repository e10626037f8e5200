#include "stages/values/best/residual_model.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "stages/entropy/rans_coder.h"

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

}  // namespace
}  // namespace tagrid
