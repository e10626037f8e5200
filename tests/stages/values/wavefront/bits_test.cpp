#include "stages/values/wavefront/bits.h"

#include <gtest/gtest.h>

namespace tagrid {
namespace {

TEST(WaveBits, NumbersComeBack) {
  std::vector<std::uint8_t> bytes;
  BitWriter writer(bytes);
  for (std::uint32_t n = 0; n < 70000; n = n < 600 ? n + 1 : n * 3) {
    writer.put_number(n);
    writer.put(n & 7, 3);
  }
  writer.finish();
  BitReader reader(bytes);
  for (std::uint32_t n = 0; n < 70000; n = n < 600 ? n + 1 : n * 3) {
    ASSERT_EQ(reader.get_number(), n);
    ASSERT_EQ(reader.get(3), n & 7);
  }
  EXPECT_TRUE(reader.finished());
}

TEST(WaveBits, AnythingElseThanTheEndIsNoticed) {
  const std::vector<std::uint8_t> bytes = {0x0f, 0x01};
  BitReader early(bytes);
  early.get(8);
  EXPECT_FALSE(early.finished()) << "a byte is left";
  BitReader rest(bytes);
  rest.get(8);
  rest.get(1);
  EXPECT_TRUE(rest.finished());
  BitReader ones(bytes);
  ones.get(8);
  EXPECT_FALSE(ones.finished());
  BitReader beyond(bytes);
  beyond.get(17);
  EXPECT_FALSE(beyond.finished()) << "a byte behind the end was used";
  BitReader none({});
  EXPECT_TRUE(none.finished());
  EXPECT_EQ(none.get(5), 0U);
  EXPECT_FALSE(none.finished());
}

// Whatever the bits are: a number has at most 18 digits.
TEST(WaveBits, NumbersOfBrokenStreamsAreLimited) {
  const std::vector<std::uint8_t> bytes(100, 0xff);
  BitReader reader(bytes);
  for (int i = 0; i < 20; ++i) EXPECT_LT(reader.get_number(), 1U << 19);
}

}  // namespace
}  // namespace tagrid
