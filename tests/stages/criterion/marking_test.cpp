// Marks of whole volumes agree with the oracle, whatever the size of the volume, its tiles, and the level
// limit.
#include "stages/criterion/marking.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <random>

#include "tests/support/conforming_activity.h"
#include "tests/support/encode_volume.h"
#include "tests/support/sample_types.h"

namespace tagrid {
namespace {

// Blobs, edges and noise: all kinds of content that cause marks.
template <class T>
oracle::Volume<T> lively_volume(Index3 dims, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const double half = 0.25 * std::numeric_limits<T>::max() * (std::numeric_limits<T>::is_signed ? 2 : 1);
  const double middle = std::numeric_limits<T>::is_signed ? 0 : 2 * half;
  const double a = 0.1 + 0.01 * static_cast<double>(random() % 40), wall = static_cast<double>(random() % 20);
  return oracle::volume_of<T>(dims, [&](double x, double y, double z) {
    const double smooth = std::sin(a * x) * std::cos(0.7 * a * y + 0.3 * z);
    const double step = x + 0.5 * y > wall ? 0.3 : -0.3;
    const double noise = (z > 6) * 0.02 * (static_cast<double>(random() % 200) / 100 - 1);
    return middle + half * (0.6 * smooth + step + noise);
  });
}

template <class T>
class Marks : public testing::Test {
 public:
  static double field_scale() {
    return 8.0 / (std::numeric_limits<T>::max() - std::numeric_limits<T>::min() + 1.0);
  }
};
TYPED_TEST_SUITE(Marks, NarrowTypes);

TYPED_TEST(Marks, EqualTheOracleAtEveryPoint) {
  const double scale = TestFixture::field_scale();
  std::int64_t marked = 0, compared = 0, near = 0;
  for (const int s : {4, 8, 16})
    for (const Index3 dims :
         {Index3{1, 1, 1}, {2, 1, 9}, {19, 6, 30}, {5, 33, 1}, {141, 3, 4}, {17, 17, 17}}) {
      const auto volume = lively_volume<TypeParam>(dims, static_cast<std::uint64_t>(dims.x * s));
      const Domain domain{dims, s};
      const LatticeBits marks = marks_of(volume, s, {20, scale, 24});
      for_each_point(domain.padded(), [&](Index3 p) {
        if (!domain.volume().contains(p) || classify(p, s).odd == 0) {
          ASSERT_FALSE(marks.test(p));
          return;
        }
        const double ratio = oracle::arc_over_chord_at(volume, p, s, scale, 20);
        ++compared;
        marked += marks.test(p);
        if (std::abs(ratio / oracle::threshold(20) - 1) <= 1e-4)
          ++near;
        else
          ASSERT_EQ(marks.test(p), ratio > oracle::threshold(20))
              << "S " << s << " at " << p.x << ' ' << p.y << ' ' << p.z << " ratio " << ratio;
      });
    }
  EXPECT_GT(marked, compared / 20);
  EXPECT_LT(marked, compared - compared / 20);
  EXPECT_LT(near, compared / 50);
}

RC_GTEST_PROP(MarksOfATile, AreThoseOfTheWholeVolume, ()) {
  const int s = *rc::gen::element(4, 8, 16);
  const Index3 dims{*rc::gen::inRange(1, 50), *rc::gen::inRange(1, 40), *rc::gen::inRange(1, 30)};
  const auto volume = lively_volume<std::int16_t>(dims, *rc::gen::arbitrary<std::uint64_t>());
  const Domain domain{dims, s};
  const MarkingParameters parameters{*rc::gen::element(6, 20, 60), 8.0 / 65536, 24};
  const LatticeBits whole = marks_of(volume, s, parameters);
  // A box of whole root cubes, and any box of points in it.
  Box cubes, box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<int>(domain.cubes(axis));
    const int first = *rc::gen::inRange(0, n), last = *rc::gen::inRange(first, n);
    cubes.low[axis] = std::int64_t{first} * s;
    cubes.high[axis] = std::int64_t{last + 1} * s;
    box.low[axis] = *rc::gen::inRange(cubes.low[axis], cubes.high[axis] + 1);
    box.high[axis] = *rc::gen::inRange(box.low[axis], cubes.high[axis] + 1);
  }
  const LatticeBits tile = marks_of(volume, s, parameters, cubes, box);
  for_each_point(box, [&](Index3 p) { RC_ASSERT(tile.test(p) == whole.test(p)); });
}

TEST(MarkCurvature, LeavesOtherBitsAsTheyAre) {
  const auto volume = lively_volume<std::uint8_t>({19, 18, 17}, 3);
  const Domain domain{volume.dims, 8};
  const Box box = domain.padded(), read = box.grown(CurvatureField::halo);
  const auto samples = volume.cut(read);
  const auto mark = [&](LatticeBits& marks) {
    mark_curvature(Samples<std::uint8_t>{read, samples.data()}, box, domain, {20, 8.0 / 256, 24}, marks);
  };
  LatticeBits marks(box), expected(box), before(box);
  for_each_point(box, [&](Index3 p) {
    if ((p.x * 7 + p.y * 3 + p.z) % 5 == 0) before.set(p);
  });
  marks = before;
  mark(marks);
  mark(expected);
  for_each_point(box, [&](Index3 p) { ASSERT_EQ(marks.test(p), before.test(p) || expected.test(p)); });
}

TEST(MarkCurvature, ALimitedRunMarksTheSamePointsUpToItsLevel) {
  const auto volume = lively_volume<std::int16_t>({37, 20, 33}, 5);
  const LatticeBits all = marks_of(volume, 16, {20, 8.0 / 65536, 24});
  for (int level = 0; level <= 12; ++level) {
    const LatticeBits limited = marks_of(volume, 16, {20, 8.0 / 65536, level});
    for_each_point(all.box(), [&](Index3 p) {
      ASSERT_EQ(limited.test(p), all.test(p) && classify(p, 16).level <= level) << "level " << level;
    });
  }
}

TEST(MarkCurvature, ALargerMNeverMarksLess) {
  const auto volume = lively_volume<std::int16_t>({33, 33, 33}, 8);
  std::int64_t last = 0;
  for (const int m : {3, 6, 10, 20, 40, 100, 1000}) {
    const std::int64_t count = count_of(marks_of(volume, 16, {m, 8.0 / 65536, 24}));
    EXPECT_GE(count, last) << m;
    last = count;
  }
  EXPECT_GT(last, 0);
}

}  // namespace
}  // namespace tagrid
