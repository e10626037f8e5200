// The criterion of the paper's section 3 on single edges: compared with a literal oracle, and on edges that
// must never violate it, whatever the precision.
#include "stages/criterion/criterion.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <random>
#include <span>

#include "stages/criterion/find_edges.h"
#include "tests/support/oracle.h"

namespace tagrid {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

void put(const oracle::Edge& e, std::size_t lane, EdgeBatch& batch) {
  batch.rise[lane] = static_cast<float>(e.rise);
  batch.slope_left[lane] = static_cast<float>(e.slope_left);
  batch.slope_right[lane] = static_cast<float>(e.slope_right);
  batch.bend_left[lane] = static_cast<float>(e.bend_left);
  batch.bend_right[lane] = static_cast<float>(e.bend_right);
  batch.length[lane] = static_cast<float>(e.length);
}

// Whether the fast test finds each of some edges: it gets them, scaled to a length of 2, as the edges of a row along y.
std::vector<bool> find_bent(std::span<const oracle::Edge> edges, const CriterionParameters& parameters) {
  const auto n = static_cast<std::int64_t>(edges.size());
  CurvatureField field({{0, 0, 0}, {2 * (n - 1), 2, 0}}, 2, 1);
  for (float* component : field.components) std::fill_n(component, 2 * edges.size(), 0.0F);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const oracle::Edge& e = edges[i];
    const std::size_t left = i, right = edges.size() + i;
    field.components[CurvatureField::value][right] = static_cast<float>(e.rise * 2 / e.length);
    field.components[CurvatureField::gy][left] = static_cast<float>(e.slope_left);
    field.components[CurvatureField::gy][right] = static_cast<float>(e.slope_right);
    field.components[CurvatureField::hyy][left] = static_cast<float>(e.bend_left * e.length / 2);
    field.components[CurvatureField::hyy][right] = static_cast<float>(e.bend_right * e.length / 2);
  }
  const PointsOfSlice row{1, 0, 1, 0, n, 1, 1, false, true, false, true};
  FoundEdges found;
  EdgePlace place;
  EXPECT_TRUE(find_edges({field, 1, row, {0, 0}}, BentTest(parameters), place, found));
  std::vector<bool> bent(edges.size());
  for (std::size_t i = 0; i < found.count; ++i) {
    const std::size_t edge = found.points[i] / 2;
    bent.at(edge) = true;
    const auto slope = static_cast<float>(edges[edge].slope_right);
    if (!std::isnan(slope)) {
      EXPECT_EQ(found.edges.slope_right[i], slope);
    }
    EXPECT_EQ(found.edges.length[i], 2);
  }
  return bent;
}

struct Verdict {
  bool straight, violated;
};

Verdict judge(const oracle::Edge& e, int m) {
  EdgeBatch batch{};
  put(e, 0, batch);
  EdgeBatch::Flags violated{};
  const CriterionParameters parameters(m);
  measure(batch, 1, parameters, violated);
  return {!find_bent(std::span(&e, 1), parameters)[0], violated[0] != 0};
}

bool violates(const oracle::Edge& e, int m) { return judge(e, m).violated; }

// Edges as they occur, and far beyond: magnitudes from a ten-thousandth to thousands.
class RandomEdges {
 public:
  explicit RandomEdges(std::uint64_t seed) : random_(seed) {}
  oracle::Edge next() {
    oracle::Edge e;
    e.length =
        std::ldexp(std::sqrt(1.0 + static_cast<double>(random_() % 3)), 1 + static_cast<int>(random_() % 7));
    e.rise = signed_magnitude() * (random_() % 2 ? e.length : 1);
    e.slope_left = signed_magnitude();
    // Half of the edges are nearly straight, where the threshold is.
    e.slope_right = random_() % 2 ? signed_magnitude() : e.slope_left * (1 + 0.1 * uniform());
    if (random_() % 2) e.rise = e.length * (e.slope_left + e.slope_right) / 2 * (1 + 0.05 * uniform());
    e.bend_left = random_() % 4 ? signed_magnitude() : 0;
    e.bend_right = random_() % 4 ? signed_magnitude() : e.bend_left;
    for (double* v : {&e.length, &e.rise, &e.slope_left, &e.slope_right, &e.bend_left, &e.bend_right})
      *v = static_cast<float>(*v);
    return e;
  }

 private:
  double uniform() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  double signed_magnitude() { return (random_() % 2 ? 1 : -1) * std::pow(10, 3.5 * uniform() - 0.5); }
  std::mt19937_64 random_;
};

TEST(Criterion, ThresholdIsThatOfTheRegularPolygon) {
  EXPECT_NEAR(CriterionParameters(20).threshold, 1.00412F, 5e-6F);
  for (const int m : {3, 4, 5, 8, 12, 20, 50, 100}) {
    EXPECT_FLOAT_EQ(CriterionParameters(m).threshold, static_cast<float>(oracle::threshold(m)));
    EXPECT_FLOAT_EQ(CriterionParameters(m).step_angle, static_cast<float>(2 * std::numbers::pi / m));
  }
}

// Not only is no edge missed: of the edges that do not violate the criterion, few are found.
TEST(Criterion, TheFirstTestLeavesFewEdgesToBeMeasured) {
  const int m = 20;
  const double allowed = oracle::threshold(m) - 1;
  std::mt19937 random(4);
  const auto uniform = [&] { return static_cast<double>(random()) / 2147483648.0 - 1; };
  int far = 0, found = 0;
  for (int i = 0; i < 20000; ++i) {
    // Parts of parabolas, of any slope, and a little else.
    const double slope = 3 * uniform(), bend = 0.3 * uniform();
    const oracle::Edge e{.length = 2,
                         .rise = 2 * slope + 0.02 * uniform(),
                         .slope_left = slope - bend + 0.02 * uniform(),
                         .bend_left = bend,
                         .slope_right = slope + bend + 0.02 * uniform(),
                         .bend_right = bend};
    if (oracle::arc_over_chord(e, m) - 1 > allowed / 8) continue;
    ++far;
    found += judge(e, m).straight ? 0 : 1;
  }
  EXPECT_GT(far, 5000);
  EXPECT_LT(found, far / 20);
}

// If R/C differs from the threshold by more than a relative 1e-4, or by more than 1 % of (threshold - 1), the
// result is the oracle's.
TEST(Criterion, AgreesWithTheOracle) {
  for (const int m : {3, 4, 7, 20, 60, 1000}) {
    RandomEdges edges(static_cast<std::uint64_t>(m));
    const double threshold = oracle::threshold(m);
    const double tolerance = std::min(1e-4 * threshold, 0.01 * (threshold - 1));
    int violating = 0, near = 0;
    constexpr int trials = 100000;
    for (int i = 0; i < trials; ++i) {
      const oracle::Edge e = edges.next();
      const double ratio = oracle::arc_over_chord(e, m);
      const Verdict verdict = judge(e, m);
      violating += verdict.violated;
      ASSERT_FALSE(verdict.straight && verdict.violated) << "m " << m << " ratio " << ratio;
      if (std::abs(ratio - threshold) <= tolerance) {
        ++near;
        continue;
      }
      ASSERT_EQ(verdict.violated, ratio > threshold)
          << "m " << m << " ratio " << ratio << " length " << e.length << " rise " << e.rise << " slopes "
          << e.slope_left << ' ' << e.slope_right << " bends " << e.bend_left << ' ' << e.bend_right;
      ASSERT_FALSE(verdict.straight && ratio > threshold);
    }
    // The test would be empty if one result were rare.
    EXPECT_GT(violating, trials / 20) << m;
    EXPECT_LT(violating, trials - trials / 20) << m;
    EXPECT_LT(near, trials / 20) << m;
  }
}

// The result is the number of multiples of the excess that an edge exceeds.
TEST(Criterion, CountsTheExcessesThatAnEdgeExceeds) {
  const CriterionParameters::Multiples multiples = {0.6, 1, 1.6};
  const CriterionParameters parameters(20, multiples);
  RandomEdges edges(7);
  std::array<int, 4> seen{};
  for (int i = 0; i < 100000; ++i) {
    const oracle::Edge e = edges.next();
    EdgeBatch batch{};
    put(e, 0, batch);
    EdgeBatch::Flags exceeded{};
    measure(batch, 1, parameters, exceeded);
    ASSERT_LE(exceeded[0], 3);
    ++seen[exceeded[0]];
    const double excess = (oracle::arc_over_chord(e, 20) - 1) / (oracle::threshold(20) - 1);
    for (std::size_t k = 0; k < multiples.size(); ++k) {
      if (std::abs(excess - multiples[k]) < 0.03) continue;
      ASSERT_EQ(exceeded[0] > k, excess > multiples[k]) << excess;
    }
    ASSERT_EQ(exceeded[0] > 1, violates(e, 20));  // the middle one is the criterion itself
  }
  for (const int n : seen) EXPECT_GT(n, 300);
}

// Slopes that differ from that of the chord by a third of the angle at one end are straight enough; slopes
// that differ by two angles are not.
TEST(Criterion, TheFirstTestSettlesEdgesThatAreAlmostStraight) {
  for (const int m : {3, 20, 1000}) {
    const double angle = std::acos(1 / oracle::threshold(m));
    for (const double length : {2.0, 16.0}) {
      const oracle::Edge almost{.length = length,
                                .rise = 0.5 * length,
                                .slope_left = 0.5,
                                .bend_left = 0,
                                .slope_right = 0.5 + angle / 3,
                                .bend_right = angle / length / 10};
      EXPECT_TRUE(judge(almost, m).straight);
      oracle::Edge bent = almost;
      bent.slope_left -= 2 * angle;
      EXPECT_FALSE(judge(bent, m).straight);
    }
  }
}

// A straight line of any slope has R = C. For every m: the excess is compared, not the rounded ratio.
RC_GTEST_PROP(Criterion, StraightEdgesNeverViolate, ()) {
  const int m = *rc::gen::element(3, 20, 300, 2000, 30000, 1000000);
  std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
  const auto between = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  for (int i = 0; i < 200; ++i) {
    oracle::Edge e;
    e.length =
        std::ldexp(std::sqrt(1.0 + static_cast<double>(random() % 3)), 1 + static_cast<int>(random() % 8));
    e.slope_left = e.slope_right = between(-1, 1) * std::pow(10, between(-6, 3));
    e.rise = e.slope_left * e.length;
    RC_ASSERT(!violates(e, m));
  }
}

// An arc of a circle violates the criterion if its angle is more than about 2 pi / m: this is the meaning of
// m.
TEST(Criterion, ArcsOfACircleAreLimitedToTheSideOfThePolygon) {
  for (const int m : {8, 12, 20, 50, 200, 1000})
    for (const double radius : {3.0, 20.0, 500.0})
      for (const double turned : {-0.6, 0.0, 0.5}) {  // direction of the chord
        const auto arc = [&](double angle) {
          const double a = turned - angle / 2, b = turned + angle / 2;
          oracle::Edge e;
          e.length = radius * (std::sin(b) - std::sin(a));
          e.rise = radius * (std::cos(a) - std::cos(b));
          e.slope_left = std::tan(a);
          e.slope_right = std::tan(b);
          e.bend_left = 1 / (radius * std::pow(std::cos(a), 3));
          e.bend_right = 1 / (radius * std::pow(std::cos(b), 3));
          return e;
        };
        const double side = 2 * std::numbers::pi / m;
        EXPECT_FALSE(violates(arc(0.8 * side), m)) << m << ' ' << radius << ' ' << turned;
        EXPECT_TRUE(violates(arc(1.25 * side), m)) << m << ' ' << radius << ' ' << turned;
      }
}

RC_GTEST_PROP(Criterion, IsBlindToDirectionAndSign, ()) {
  RandomEdges edges(*rc::gen::arbitrary<std::uint64_t>());
  for (int i = 0; i < 50; ++i) {
    const oracle::Edge e = edges.next();
    const double ratio = oracle::arc_over_chord(e, 20);
    if (std::abs(ratio - oracle::threshold(20)) < 1e-4) continue;
    const oracle::Edge upside_down{e.length,     -e.rise,        -e.slope_left,
                                   -e.bend_left, -e.slope_right, -e.bend_right};
    const oracle::Edge backwards{e.length, -e.rise, -e.slope_right, e.bend_right, -e.slope_left, e.bend_left};
    RC_ASSERT(violates(e, 20) == violates(upside_down, 20));
    RC_ASSERT(violates(e, 20) == violates(backwards, 20));
  }
}

TEST(Criterion, NonFiniteInputViolatesNothing) {
  for (const float bad : {infinity, -infinity, not_a_number})
    for (int which = 0; which < 5; ++which)
      for (const double other : {0.0, 3.0}) {
        oracle::Edge e{8, other, -other, other, other, other};
        double* const inputs[5] = {&e.rise, &e.slope_left, &e.slope_right, &e.bend_left, &e.bend_right};
        *inputs[which] = bad;
        EXPECT_FALSE(violates(e, 20)) << bad << ' ' << which;
        EXPECT_FALSE(violates(e, 3)) << bad << ' ' << which;
      }
}

// Heights from an absurd value range: products of four lengths overflow, but the results must be right.
TEST(Criterion, HugeHeightsAreJudgedLikeOthers) {
  for (const double size : {1e6, 1e9, 1e12, 1e15}) {
    const oracle::Edge bump{2, size, -size, 0, size, 0};
    EXPECT_TRUE(violates(bump, 20)) << size;
    const oracle::Edge straight{2, 2 * size, size, 0, size, 0};
    EXPECT_FALSE(violates(straight, 20)) << size;
  }
}

TEST(Criterion, EveryLaneOfABatchIsJudgedAlone) {
  RandomEdges edges(99);
  EdgeBatch batch{};
  std::array<oracle::Edge, 128> all;
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i] = edges.next();
    all[i].length = 8;
    put(all[i], i, batch);
  }
  const CriterionParameters parameters(20);
  for (const std::size_t count : {1U, 3U, 15U, 17U, 63U, 64U, 127U, 128U}) {
    EdgeBatch::Flags violated;
    const std::vector<bool> bent = find_bent(std::span(all).first(count), parameters);
    measure(batch, count, parameters, violated);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Verdict alone = judge(all[i], 20);
      if (i >= count) continue;
      EXPECT_EQ(bent[i], !alone.straight);
      EXPECT_EQ(violated[i], alone.violated);
    }
  }
}

}  // namespace
}  // namespace tagrid
