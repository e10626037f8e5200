// What only the coder of points of wide types refuses.
#include "stages/values/points/wide_coding.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/brick_samples.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/sample_types.h"

namespace tagrid {
namespace {

template <class T>
class WidePointCoding : public testing::Test {};
TYPED_TEST_SUITE(WidePointCoding, WideIntegers);

// The bit that says whether values escape comes first, so it is a bit of the decoder's first state, and no
// other event depends on it.
TYPED_TEST(WidePointCoding, IntegersThatEscapeAreRefused) {
  constexpr int s = 8;
  const Box box{{0, 0, 0}, {s, 2 * s, s}};
  const Domain domain{box.high + Index3{1, 1, 1}, s};
  const LatticeBits active = cut(random_activity_of(domain, 30, 5), box);
  std::mt19937 random(1);
  std::vector<TypeParam> values(static_cast<std::size_t>(box.count())), decoded(values.size());
  for (TypeParam& value : values) value = static_cast<TypeParam>(random() % 1000);
  for (const double error : {0.0, 7.0}) {
    std::vector<TypeParam> stored = values;
    for (TypeParam& value : stored) value = stored_point(value, error);
    std::vector<std::uint8_t> bytes;
    encode_points<TypeParam>(stored, active, s, error, bytes);
    EXPECT_TRUE(decode_points<TypeParam>(bytes, active, s, error, decoded).ok());
    bytes[1] ^= 0x80;
    EXPECT_FALSE(decode_points<TypeParam>(bytes, active, s, error, decoded).ok());
  }
}

}  // namespace
}  // namespace tagrid
