// The activity as bytes and back. Whatever the bytes, the result is a conforming set.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>

#include "stages/activity/coding.h"
#include "stages/activity/contexts.h"
#include "stages/grid/conformity.h"
#include "stages/grid/lattice.h"
#include "stages/sample/instruction_sets.h"
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

// Candidates and contexts, which are found for whole words of points, compared with their definitions in
// docs/dev/format.md, point by point. (The second decoder compares the sets of neighbours.)

std::vector<Pass> passes_of(int cube_size) {
  std::vector<Pass> passes;
  for (std::int64_t unit = cube_size / 2; unit >= 1; unit /= 2)
    for (const unsigned axes : {7U, 3U, 5U, 6U, 1U, 2U, 4U})
      passes.push_back({unit, {(axes & 1) != 0, (axes & 2) != 0, (axes & 4) != 0}, std::popcount(axes)});
  return passes;
}

bool belongs(Index3 p, const Pass& pass, int cube_size) {
  const PointClass c = classify(p, cube_size);
  return c.odd == pass.odd_count && c.unit == pass.unit && c.is_odd[0] == pass.odd[0] &&
         c.is_odd[1] == pass.odd[1] && c.is_odd[2] == pass.odd[2];
}

/// Visits the points of a box, whose corners are corners of root cubes, that a pass codes.
template <class Visit>
void for_each_of(const Pass& pass, const Box& box, Visit visit) {
  const auto first = [&](std::int64_t low, int axis) { return low + (pass.odd[axis] ? pass.unit : 0); };
  for (std::int64_t z = first(box.low.z, 2); z <= box.high.z; z += 2 * pass.unit)
    for (std::int64_t y = first(box.low.y, 1); y <= box.high.y; y += 2 * pass.unit)
      for (std::int64_t x = first(box.low.x, 0); x <= box.high.x; x += 2 * pass.unit) visit(Index3{x, y, z});
}

/// What is known when a pass is coded, in sets of one box: of the passes before, all; of this one, the rows before.
struct Known {
  LatticeBits active, candidates;
  std::array<LatticeBits, Forecast::levels> forecast;

  bool is(const LatticeBits& bits, Index3 p) const { return bits.box().contains(p) && bits.test(p); }
  int forecast_of(Index3 p) const {
    return int{is(forecast[0], p)} + int{is(forecast[1], p)} + int{is(forecast[2], p)};
  }
};

struct Sums {
  int around = 0, beside = 0;                                              ///< active
  int more_beside = 0, less_beside = 0, more_around = 0, less_around = 0;  ///< against the forecast
};

Sums sums_at(const Known& known, const Pass& pass, Index3 p) {
  const Surroundings surroundings(pass);
  Sums sums;
  for (const Index3 step : surroundings.around()) {
    const bool active = known.is(known.active, p + step), expected = known.forecast_of(p + step) >= 2;
    sums.around += active;
    sums.more_around += active && !expected;
    sums.less_around += !active && expected;
  }
  for (const Index3 step : surroundings.beside()) {
    const bool active = known.is(known.active, p + step), expected = known.forecast_of(p + step) >= 2;
    sums.beside += active;
    sums.more_beside += active && !expected;
    sums.less_beside += known.is(known.candidates, p + step) && !active && expected;
  }
  return sums;
}

std::array<std::size_t, 3> with_forecast(const Known& known, const Pass& pass, Index3 p) {
  int surprise = 0, on = 0, off = 0, forecasts = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Index3 d = 2 * pass.unit * unit_vector(axis), before = p - d;
    forecasts += known.forecast_of(before) + known.forecast_of(p + d);
    if (!known.is(known.candidates, before)) continue;
    const bool active = known.is(known.active, before), expected = known.forecast_of(before) >= 2;
    ++(active ? on : off);
    surprise += int{active} - int{expected};
  }
  const Sums sums = sums_at(known, pass, p);
  const auto two = [](int n) { return std::min(n, 2); };
  const int beside = two(sums.more_beside) - two(sums.less_beside),
            around = two(sums.more_around) - two(sums.less_around);
  const Box& box = known.active.box();
  const bool border = !Box{box.low + Index3{1, 1, 1}, box.high - Index3{1, 1, 1}}.contains(p);
  const int own = known.forecast_of(p), point = 8 * (pass.odd_count - 1) + 4 * int{border} + own;
  return {static_cast<std::size_t>(175 * point + 25 * (surprise + 3) + 5 * (beside + 2) + around + 2),
          static_cast<std::size_t>(160 * point + 10 * (4 * on + off) + forecasts / 2),
          static_cast<std::size_t>(own)};
}

std::array<std::size_t, 3> without_forecast(const Known& known, const Pass& pass, Index3 p) {
  int on = 0, directed = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Index3 d = 2 * pass.unit * unit_vector(axis);
    const int state = known.is(known.active, p - d) ? 2 : known.is(known.candidates, p - d) ? 1 : 0;
    on += state == 2;
    directed = 6 * directed + 2 * state + int{known.is(known.candidates, p + d)};
  }
  const Sums sums = sums_at(known, pass, p);
  const int odd = pass.odd_count - 1, around = (sums.around + 1) / 2;
  return {static_cast<std::size_t>(9 * (4 * (13 * odd + around) + on) + sums.beside),
          static_cast<std::size_t>(13 * (216 * odd + directed) + around), static_cast<std::size_t>(odd)};
}

/// Goes through all passes as the coder does. Returns the number of candidates.
template <class Contexts, class Definition>
std::size_t compare(const LatticeBits& all, const Known& start, int cube_size, Definition definition) {
  Known known = start;
  const Box& box = all.box();
  for_each_point(box, [&](Index3 p) {
    if (classify(p, cube_size).odd > 0) return;
    known.active.set(p);
    for (LatticeBits& forecast : known.forecast) forecast.set(p);
  });
  const Forecast forecast(known.forecast);
  Candidates candidates(known.active, cube_size);
  Contexts contexts(known.active, candidates.bits(), forecast);
  std::size_t count = 0;
  for (const Pass& pass : passes_of(cube_size)) {
    candidates.find(pass);
    contexts.begin_pass(pass);
    for_each_of(pass, box, [&](Index3 p) {
      bool expected = true;
      for (const Index3 parent : parents(p, classify(p, cube_size), cube_size))
        if (box.contains(parent) && !known.active.test(parent)) expected = false;
      EXPECT_EQ(candidates.bits().test(p), expected) << p.x << ' ' << p.y << ' ' << p.z;
      if (expected) known.candidates.set(p);
    });
    for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
      for (std::int64_t y = box.low.y; y <= box.high.y; ++y) {
        bool bit = false;  // of the candidate before, which is all that the coder remembers
        for (std::size_t i = 0; i < all.words_per_row(); ++i) {
          Word wanted = candidates.bits().row(y, z)[i] & candidates.mask()[i];
          const std::int64_t first = box.low.x + static_cast<std::int64_t>(64 * i);
          if (wanted == 0 || !belongs({first + std::countr_zero(wanted), y, z}, pass, cube_size)) continue;
          contexts.look(y, z, i);
          for (; wanted != 0; wanted &= wanted - 1, ++count) {
            const int x = std::countr_zero(wanted);
            const Index3 p{first + x, y, z};
            const PointContext context = contexts.at(x, bit);
            const std::array<std::size_t, 3> wants = definition(known, pass, p);
            EXPECT_EQ(context.of[0], wants[0]) << p.x << ' ' << p.y << ' ' << p.z;
            EXPECT_EQ(context.of[1] - Contexts::sizes[0], wants[1]) << p.x << ' ' << p.y << ' ' << p.z;
            EXPECT_EQ(context.mixer, wants[2]);
            EXPECT_LT(context.of[0], Contexts::sizes[0]);
            EXPECT_LT(context.of[1], Contexts::models().size());
            bit = all.test(p);
            if (bit) known.active.set(p);
          }
        }
      }
    contexts.end_pass(candidates.mask());
    if (testing::Test::HasFailure()) break;
  }
  return count;
}

Known any_knowledge(const Box& box, int cube_size, const LatticeBits& all) {
  Known known{LatticeBits(box), LatticeBits(box), {}};
  const auto points = static_cast<int>(box.count());
  // Sets that are subsets of each other, related to the activity only where they are random.
  known.forecast[2] = random_conforming_activity(box, cube_size, points / 400, 3);
  for (const std::size_t level : {1U, 0U}) {
    known.forecast[level] = random_conforming_activity(box, cube_size, points / 300, level);
    for (std::size_t i = 0; i < all.words().size(); ++i) {
      const Word more = level == 1 && i % 3 != 0 ? all.words()[i] : 0;
      known.forecast[level].words()[i] |= known.forecast[level + 1].words()[i] | more;
    }
  }
  return known;
}

TEST(ActivityContexts, AreTheirDefinitionsInBoxesOfAllShapes) {
  struct Case {
    int cube_size;
    Index3 cubes;
  };
  for (const auto& [s, cubes] :
       {Case{4, {3, 2, 4}}, {4, {40, 1, 1}}, {8, {2, 3, 1}}, {16, {2, 1, 2}}, {32, {2, 1, 1}}}) {
    SCOPED_TRACE(testing::Message() << s << ": " << cubes.x << ' ' << cubes.y << ' ' << cubes.z);
    const Index3 low{2 * s, 0, s};
    const Box box{low, low + s * cubes};
    const LatticeBits all = random_conforming_activity(box, s, static_cast<int>(box.count() / 40), 5);
    const Known known = any_knowledge(box, s, all);
    EXPECT_GT(compare<ForecastContexts>(all, known, s, with_forecast), 100U);
    EXPECT_GT(compare<PlainContexts>(all, known, s, without_forecast), 100U);
    if (HasFailure()) return;
  }
}

// Neighbours are words away.
TEST(ActivityContexts, AreTheirDefinitionsForLargeRootCubes) {
  const int s = 128;
  const Box box{{0, 0, 0}, {256, 128, 128}};
  LatticeBits all(box);
  std::mt19937_64 random(1);
  for (int i = 0; i < 40; ++i)
    all.set({static_cast<std::int64_t>(random() % 17 * 8), static_cast<std::int64_t>(random() % 17 * 8),
             static_cast<std::int64_t>(random() % 17 * 8)});
  close_naively(all, s);
  // A forecast that is right about most of the points.
  Known known{LatticeBits(box), LatticeBits(box), {all, all, LatticeBits(box)}};
  for (int i = 0; i < 3000; ++i) {
    const std::size_t word = random() % all.words().size();
    known.forecast[1].words()[word] &= known.forecast[0].words()[word] &= random();
  }
  known.forecast[2].set({64, 64, 64});
  EXPECT_GT(compare<ForecastContexts>(all, known, s, with_forecast), 100U);
  EXPECT_GT(compare<PlainContexts>(all, known, s, without_forecast), 100U);
}

TEST(ActivityContexts, BytesOfPointsAreTheBitsOfWords) {
  std::mt19937_64 random(2);
  BytesOfPoints::Words words;
  for (Word& word : words) word = random();
  for (const std::int64_t sets : std::vector<std::int64_t>{HWY_AVX3, HWY_AVX2, HWY_SSE4, 0}) {
    limit_instruction_sets(sets | HWY_STATIC_TARGET);
    BytesOfPoints bytes;
    bytes.transpose(words);
    for (int i = 0; i < 64; ++i)
      for (std::size_t k = 0; k < 8; ++k) EXPECT_EQ(bytes[i] >> k & 1, words[k] >> i & 1);
  }
  limit_instruction_sets(0);
}

}  // namespace
}  // namespace tagrid
