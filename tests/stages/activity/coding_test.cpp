// The activity as bytes and back. Whatever the bytes, the result is a conforming set.
#include "stages/activity/coding.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <random>

#include "stages/grid/conformity.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/oracle.h"

namespace tagrid {
namespace {

std::vector<std::uint8_t> encoded(const LatticeBits& active, int cube_size, int level = 24,
                                  const Forecast& forecast = {}) {
  std::vector<std::uint8_t> bytes;
  encode_activity(active, forecast, cube_size, level, bytes);
  return bytes;
}

struct Decoded {
  bool ok;
  LatticeBits active;
};
Decoded decoded(std::span<const std::uint8_t> bytes, const Box& box, int cube_size, int level = 24,
                const Forecast& forecast = {}) {
  Decoded d{false, LatticeBits(box)};
  d.ok = decode_activity(bytes, forecast, cube_size, level, d.active).ok();
  return d;
}

LatticeBits random_activity(const Box& box, int cube_size, int marks, std::uint64_t seed) {
  LatticeBits bits = random_marks(box, marks, seed);
  oracle::close_under_parents(bits, cube_size);
  return bits;
}

struct RandomGrid {
  int cube_size;
  Box box;
  LatticeBits active;
};
RandomGrid random_grid(int largest_cube) {
  RandomGrid g;
  do g.cube_size = *rc::gen::element(4, 8, 16, 32);
  while (g.cube_size > largest_cube);
  const int most = g.cube_size >= 16 ? 2 : 5;
  const auto edge = [&](int n) { return std::int64_t{*rc::gen::inRange(1, n + 1)} * g.cube_size; };
  const Index3 low = (edge(3) - g.cube_size) * Index3{1, 0, 2};
  g.box = {low, low + Index3{edge(most), edge(most), edge(most)}};
  const auto n = static_cast<int>(g.box.count());
  g.active = random_activity(g.box, g.cube_size, *rc::gen::element(0, 1, 5, n / 500, n / 20, 2 * n),
                             *rc::gen::arbitrary<std::uint64_t>());
  return g;
}

RC_GTEST_PROP(ActivityCoding, RoundTripIsExactForBoxesOfAllShapes, ()) {
  const RandomGrid g = random_grid(32);
  const auto bytes = encoded(g.active, g.cube_size);
  const Decoded d = decoded(bytes, g.box, g.cube_size);
  RC_ASSERT(d.ok);
  RC_ASSERT(d.active == g.active);
}

// A forecast that has no relation to the activity, or is the activity.
Forecast any_forecast(const RandomGrid& g, std::uint64_t seed) {
  const auto n = static_cast<int>(g.box.count());
  std::array<LatticeBits, Forecast::levels> exceeding;
  exceeding[2] = random_activity(g.box, g.cube_size, n / 50, seed);
  exceeding[1] = seed % 2 ? g.active : exceeding[2];
  for (std::size_t i = 0; i < exceeding[1].words().size(); ++i)
    exceeding[1].words()[i] |= exceeding[2].words()[i];
  exceeding[0] = random_activity(g.box, g.cube_size, n / 30, seed + 1);
  for (std::size_t i = 0; i < exceeding[0].words().size(); ++i)
    exceeding[0].words()[i] |= exceeding[1].words()[i];
  return Forecast(exceeding);
}

RC_GTEST_PROP(ActivityCoding, RoundTripIsExactWhateverTheForecast, ()) {
  const RandomGrid g = random_grid(16);
  const Forecast forecast = any_forecast(g, *rc::gen::arbitrary<std::uint64_t>());
  const auto bytes = encoded(g.active, g.cube_size, 24, forecast);
  const Decoded d = decoded(bytes, g.box, g.cube_size, 24, forecast);
  RC_ASSERT(d.ok);
  RC_ASSERT(d.active == g.active);
}

// Rows of several words: contexts reach from one word into the next.
TEST(ActivityCoding, LongRowsRoundTripAndBearAnyBytes) {
  for (const auto& [cube_size, size] :
       {std::pair{4, Index3{160, 8, 8}}, {64, {256, 64, 64}}, {256, {512, 256, 256}}}) {
    RandomGrid g{cube_size, {{0, 0, 0}, size}, {}};
    g.active = random_activity(g.box, cube_size, 300, 8);
    std::mt19937_64 random(6);
    for (const bool forecasting : {true, false}) {
      const Forecast forecast = forecasting && cube_size < 256 ? any_forecast(g, 3) : Forecast();
      auto bytes = encoded(g.active, cube_size, 24, forecast);
      const Decoded d = decoded(bytes, g.box, cube_size, 24, forecast);
      EXPECT_TRUE(d.ok && d.active == g.active) << cube_size;
      if (cube_size > 64) continue;
      for (int i = 0; i < 20; ++i) {
        for (std::size_t k = random() % bytes.size(); k < bytes.size(); ++k)
          bytes[k] = static_cast<std::uint8_t>(random());
        EXPECT_TRUE(is_conforming(decoded(bytes, g.box, cube_size, 24, forecast).active, g.box, cube_size));
      }
    }
  }
}

TEST(ActivityCoding, ARightForecastSavesMostOfTheBytes) {
  RandomGrid g{16, {{0, 0, 0}, {64, 64, 64}}, {}};
  g.active = random_activity(g.box, 16, 5000, 1);
  const Forecast right({g.active, g.active, g.active});
  EXPECT_LT(4 * encoded(g.active, 16, 24, right).size(), encoded(g.active, 16).size());
}

TEST(ActivityCoding, RoundTripHoldsForLargeRootCubes) {
  for (const int s : {64, 128, 256})
    for (const int marks : {0, 3, 200}) {
      const Box box{{s, 0, 0}, {s == 64 ? 4 * s : 2 * s, s, s == 64 ? 2 * s : s}};
      const LatticeBits active = random_activity(box, s, marks, 5);
      const Decoded d = decoded(encoded(active, s), box, s);
      EXPECT_TRUE(d.ok);
      EXPECT_TRUE(d.active == active) << "S " << s << " marks " << marks;
    }
}

TEST(ActivityCoding, FullAndEmptyGridsCostNextToNothing) {
  const Box box{{0, 0, 0}, {64, 64, 64}};
  LatticeBits full(box), empty(box);
  for_each_point(box, [&](Index3 p) { full.set(p); });
  oracle::close_under_parents(empty, 32);
  for (const LatticeBits* bits : {&full, &empty}) {
    const auto bytes = encoded(*bits, 32);
    EXPECT_LT(bytes.size(), bits == &full ? 300U : 16U);
    const Decoded d = decoded(bytes, box, 32);
    EXPECT_TRUE(d.ok && d.active == *bits);
  }
}

// A limited run has no points above its level, so none are coded.
TEST(ActivityCoding, LevelsAboveTheLimitAreNotCoded) {
  const Box box{{0, 0, 0}, {32, 16, 48}};
  std::size_t last = 0;
  for (int level = 0; level <= 12; ++level) {
    LatticeBits limited(box);
    for_each_point(box, [&](Index3 p) {
      const bool pick = (p.x * 5 + p.y * 3 + p.z) % 7 != 0;
      const PointClass c = classify(p, 16);
      if (c.level <= level && (pick || c.level < level || level == 0)) limited.set(p);
    });
    const auto bytes = encoded(limited, 16, level);
    const Decoded d = decoded(bytes, box, 16, level);
    EXPECT_TRUE(d.ok && d.active == limited) << level;
    EXPECT_GE(bytes.size(), last);
    last = bytes.size();
  }
}

TEST(ActivityCoding, AppendsToWhatIsThere) {
  const Box box{{0, 0, 0}, {16, 8, 8}};
  const LatticeBits active = random_activity(box, 8, 30, 2);
  std::vector<std::uint8_t> bytes{255, 255, 255};
  encode_activity(active, {}, 8, 24, bytes);
  EXPECT_EQ(std::vector<std::uint8_t>(bytes.begin() + 3, bytes.end()), encoded(active, 8));
  EXPECT_EQ(bytes[2], 255);
}

// The coder reads words of two bytes, so half a word is always noticed. A stream that ends with a whole word
// may happen to be that of another set (checksums belong to the container).
TEST(ActivityCoding, EveryTruncationGivesAConformingSet) {
  const Box box{{0, 0, 0}, {24, 16, 24}};
  const LatticeBits active = random_activity(box, 8, 200, 4);
  const auto bytes = encoded(active, 8);
  ASSERT_GT(bytes.size(), 50U);
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    // A copy with its own size, so that a read past the end is noticed.
    const std::vector<std::uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
    const Decoded d = decoded(cut, box, 8);
    EXPECT_FALSE(d.ok && n % 2 != 0) << n;
    EXPECT_FALSE(d.ok && d.active == active) << n;
    EXPECT_TRUE(is_conforming(d.active, box, 8)) << n;
  }
  for (const std::size_t more : {1U, 4U, 100U}) {
    std::vector<std::uint8_t> longer = bytes;
    longer.resize(bytes.size() + more);
    EXPECT_FALSE(decoded(longer, box, 8).ok) << more;
  }
}

TEST(ActivityCoding, FlippedBitsGiveConformingSets) {
  const Box box{{8, 0, 8}, {24, 8, 24}};
  const LatticeBits active = random_activity(box, 8, 60, 4);
  const auto bytes = encoded(active, 8);
  std::size_t noticed = 0;
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    auto broken = bytes;
    broken[bit / 8] = static_cast<std::uint8_t>(broken[bit / 8] ^ 1U << bit % 8);
    const Decoded d = decoded(broken, box, 8);
    noticed += !d.ok || !(d.active == active);
    ASSERT_TRUE(is_conforming(d.active, box, 8)) << bit;
  }
  // The decoder must end in the state with which the encoder began.
  EXPECT_EQ(noticed, 8 * bytes.size());
}

RC_GTEST_PROP(ActivityCoding, AnyBytesGiveAConformingSetUpToTheLevel, ()) {
  const RandomGrid g = random_grid(8);
  const auto bytes = *rc::gen::arbitrary<std::vector<std::uint8_t>>();
  const int level = *rc::gen::inRange(0, 10);
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  const Decoded d =
      decoded(bytes, g.box, g.cube_size, level, seed % 4 == 0 ? Forecast() : any_forecast(g, seed));
  RC_ASSERT(is_conforming(d.active, g.box, g.cube_size));
  for_each_point(g.box, [&](Index3 p) {
    if (d.active.test(p)) RC_ASSERT(classify(p, g.cube_size).level <= level);
  });
}

}  // namespace
}  // namespace tagrid
