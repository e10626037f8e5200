#include "stages/values/points/field.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

#include "stages/mesh/tetrahedra.h"
#include "tests/support/conforming_activity.h"

namespace tagrid {
namespace {

struct RandomField {
  int cube_size;
  Box box;
  LatticeBits active;
  std::vector<std::int32_t> samples;  ///< of all points; only those of active points may have an effect
};

RandomField random_field() {
  RandomField f;
  f.cube_size = *rc::gen::element(4, 8, 16);
  const auto cubes = [&] { return std::int64_t{*rc::gen::inRange(1, 3)} * f.cube_size; };
  const Index3 low = std::int64_t{f.cube_size} * Index3{2, 1, 3};
  f.box = {low, low + Index3{cubes(), cubes(), cubes()}};
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  f.active = random_conforming_activity(f.box, f.cube_size, *rc::gen::element(0, 1, 5, 40, 500), seed);
  std::mt19937_64 random(seed);
  const bool extreme = *rc::gen::arbitrary<bool>();
  for_each_point(f.box, [&](Index3) {
    const auto any = static_cast<std::int16_t>(random());
    f.samples.push_back(!extreme ? any : any < 0 ? -32768 : 32767);
  });
  return f;
}

template <class Number>
std::vector<Number> fixed_samples(const RandomField& f) {
  std::vector<Number> values;
  for_each_point(f.box, [&](Index3 p) {
    // The previous values of inactive points must have no effect.
    const std::int32_t sample = f.samples[static_cast<std::size_t>(f.box.offset(p))];
    values.push_back(f.active.test(p) ? static_cast<Number>(sample) * static_cast<Number>(f.cube_size)
                                      : Number{12345});
  });
  return values;
}

RC_GTEST_PROP(Interpolation, IsLinearInEveryLeafTetrahedron, ()) {
  const RandomField f = random_field();
  auto values = fixed_samples<std::int32_t>(f);
  interpolate<std::int32_t>(f.active, f.box, f.cube_size, values);
  LatticeBits seen(f.box);
  for_each_leaf_tetrahedron(f.active, f.box, f.cube_size, 24, [&](const Tetrahedron& t) {
    Box bounds{t.vertices[0], t.vertices[0]};
    for (Index3 v : t.vertices)
      for (int axis = 0; axis < 3; ++axis) {
        bounds.low[axis] = std::min(bounds.low[axis], v[axis]);
        bounds.high[axis] = std::max(bounds.high[axis], v[axis]);
      }
    for_each_point(bounds, [&](Index3 p) {
      std::int64_t weighted = 0;
      bool inside = true;
      for (std::size_t i = 0; i < 4; ++i) {
        auto with_p = t.vertices;
        with_p[i] = p;
        const std::int64_t weight = six_volumes(with_p);
        inside &= weight >= 0;
        weighted += weight * f.cube_size * f.samples[static_cast<std::size_t>(f.box.offset(t.vertices[i]))];
      }
      if (!inside) return;
      seen.set(p);
      RC_ASSERT(weighted == six_volumes(t.vertices) * values[static_cast<std::size_t>(f.box.offset(p))]);
    });
  });
  for_each_point(f.box, [&](Index3 p) { RC_ASSERT(seen.test(p)); });
}

// The definition, point by point, without the row loops.
RC_GTEST_PROP(Interpolation, IsTheMeanOfTheBaseEdgeForAnyBits, ()) {
  RandomField f = random_field();
  std::mt19937_64 random(7);
  for_each_point(f.box, [&](Index3 p) {
    if (random() % 4 == 0) f.active.set(p);
  });
  auto values = fixed_samples<double>(f), expected = values;
  interpolate<double>(f.active, f.box, f.cube_size, values);
  for (int level = 1; level <= max_level(f.cube_size); ++level)
    for_each_point(f.box, [&](Index3 p) {
      const PointClass c = classify(p, f.cube_size);
      if (c.level != level || f.active.test(p)) return;
      const BaseEdge e = base_edge(p, c, f.cube_size);
      const auto at = [&](Index3 q) -> double& {
        return expected[static_cast<std::size_t>(f.box.offset(q))];
      };
      at(p) = (at(e.left) + at(e.right)) * 0.5;
    });
  RC_ASSERT(values == expected);
}

RC_GTEST_PROP(Interpolation, WideAndNarrowNumbersAgree, ()) {
  const RandomField f = random_field();
  auto narrow = fixed_samples<std::int32_t>(f);
  auto wide = fixed_samples<std::int64_t>(f);
  auto floating = fixed_samples<double>(f);
  interpolate<std::int32_t>(f.active, f.box, f.cube_size, narrow);
  interpolate<std::int64_t>(f.active, f.box, f.cube_size, wide);
  interpolate<double>(f.active, f.box, f.cube_size, floating);
  for (std::size_t i = 0; i < narrow.size(); ++i) {
    RC_ASSERT(wide[i] == narrow[i]);
    RC_ASSERT(floating[i] == static_cast<double>(narrow[i]));
  }
}

RC_GTEST_PROP(Interpolation, ReadsItsOwnBoxOfLargerBits, ()) {
  const RandomField f = random_field();
  LatticeBits large(f.box.grown(f.cube_size));
  for (auto& word : large.words()) word = 0x5a5a;
  copy_bits(f.active, large);
  auto values = fixed_samples<std::int32_t>(f), expected = values;
  interpolate<std::int32_t>(f.active, f.box, f.cube_size, expected);
  interpolate<std::int32_t>(large, f.box, f.cube_size, values);
  RC_ASSERT(values == expected);
}

TEST(Rounding, HalvesGoUpOnceAtTheEnd) {
  EXPECT_EQ((from_fixed<std::int16_t, std::int32_t>(-4, 8)), 0);   // -1/2
  EXPECT_EQ((from_fixed<std::int16_t, std::int32_t>(-5, 8)), -1);  // -5/8
  EXPECT_EQ((from_fixed<std::int16_t, std::int32_t>(-12, 8)), -1);
  EXPECT_EQ((from_fixed<std::int16_t, std::int32_t>(4, 8)), 1);
  EXPECT_EQ((from_fixed<std::int16_t, std::int32_t>(3, 8)), 0);
  for (int cube_size : {4, 32, 256})
    for (int sample : {-32768, -1, 0, 1, 32767}) {
      const auto fixed = to_fixed<std::int32_t>(static_cast<std::int16_t>(sample), cube_size);
      EXPECT_EQ((from_fixed<std::int16_t>(fixed, cube_size)), sample);
    }
  const std::vector<std::int32_t> values = {-5, -4, 3, 4, 2040};
  std::vector<std::int16_t> samples(values.size());
  round_to_samples<std::int16_t, std::int32_t>(values, 8, samples);
  EXPECT_EQ(samples, (std::vector<std::int16_t>{-1, 0, 0, 1, 255}));
}

}  // namespace
}  // namespace tagrid
