#include "stages/voxels/residual_model.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <memory>

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

RC_GTEST_PROP(ResidualCoding, ResidualsOfAnySizeComeBackInAnyContext, ()) {
  struct Item {
    std::int32_t residual;
    bool flat;
    ResidualContext context;
  };
  const auto largest = *rc::gen::element<std::int32_t>(1, 3, 255, 65536);
  std::vector<Item> items(*rc::gen::inRange<std::size_t>(0, 200));
  for (Item& item : items) {
    item.residual = *rc::gen::inRange<std::int32_t>(-largest, largest + 1);
    item.flat = *rc::gen::inRange(0, 5) == 0;
    item.context = {*rc::gen::inRange<std::uint32_t>(0, energy_contexts),
                    *rc::gen::inRange<std::uint32_t>(0, spread_contexts),
                    *rc::gen::inRange<std::uint32_t>(0, level_contexts), *rc::gen::inRange(0, 11),
                    *rc::gen::inRange(0, 2) == 1};
  }
  std::vector<std::uint8_t> bytes;
  RansEncoder encoder(bytes);
  const auto writer = std::make_unique<ResidualModel>(), reader = std::make_unique<ResidualModel>();
  const auto code = [&](ResidualModel& model, auto& coder, const Item& item, std::int32_t residual) {
    return item.flat ? model.code_flat(coder, residual, largest)
                     : model.code(coder, residual, largest, item.context);
  };
  for (const Item& item : items) RC_ASSERT(code(*writer, encoder, item, item.residual) == item.residual);
  encoder.finish();
  RansDecoder decoder(bytes);
  for (const Item& item : items) RC_ASSERT(code(*reader, decoder, item, 0) == item.residual);
  RC_ASSERT(decoder.finished());
}

// A damaged stream can hold any residual. It is part of the context of later ones, so its size is limited.
template <class Model>
void expect_limited(std::int32_t low_bits, bool flip) {
  constexpr std::int32_t largest = 2;
  const ResidualContext context{30, 40, 50, low_bits, flip};
  for (const std::int32_t residual : {-3000, -8, -7, -3, -2, 0, 2, 3, 7, 8, 3000}) {
    std::vector<std::uint8_t> bytes;
    RansEncoder encoder(bytes);
    const auto writer = std::make_unique<Model>(), reader = std::make_unique<Model>();
    writer->code(encoder, residual, 1 << 16, context);
    encoder.finish();
    RansDecoder decoder(bytes);
    EXPECT_EQ(reader->code(decoder, 0, largest, context), std::clamp(residual, -largest, largest))
        << residual << ", " << low_bits << " low bits";
    EXPECT_TRUE(decoder.finished());
  }
}

TEST(ResidualCoding, DecodedResidualsAreNoLargerThanAllowed) {
  for (const std::int32_t low_bits : {0, 1, 5})
    for (const bool flip : {false, true}) {
      expect_limited<ResidualModel>(low_bits, flip);
      expect_limited<FastResidualModel>(low_bits, flip);
    }
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
