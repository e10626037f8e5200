// Candidates and contexts, which are found for whole words of points, compared with their definitions in
// docs/format.md, point by point. (The second decoder compares the sets of neighbours.)
#include "stages/activity/contexts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <random>

#include "stages/grid/lattice.h"
#include "stages/sample/instruction_sets.h"
#include "tests/support/conforming_activity.h"

namespace tagrid {
namespace {

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
