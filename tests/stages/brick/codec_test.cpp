// A volume as bricks and back: every voxel is within the bound, and every shared face is the same from both
// sides.
#include "stages/brick/codec.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <map>

#include "stages/brick/sample_statistics.h"
#include "stages/values/points/coding.h"
#include "tests/support/brick_samples.h"
#include "tests/support/conforming_activity.h"

namespace tagrid {
namespace {

struct Coded {
  CodingParameters parameters;
  LatticeBits activity;
  int marks = 0;
  std::uint64_t seed = 0;
};

Coded random_parameters(SampleType type, FileMode mode) {
  Coded c;
  CodingParameters& p = c.parameters;
  p.type = type;
  p.mode = mode;
  p.cube_size = *rc::gen::element(4, 8, 16);
  p.brick_edge = *rc::gen::inRange(1, 4);
  p.max_level = max_level(p.cube_size);
  const auto length = [] { return std::int64_t{*rc::gen::inRange(1, 36)}; };
  p.dims = {length(), length(), length()};
  c.seed = *rc::gen::arbitrary<std::uint64_t>();
  const auto points = static_cast<int>(p.domain().padded().count());
  c.marks = *rc::gen::element(0, 2, points / 300, points / 20, points);
  c.activity = random_activity_of(p.domain(), c.marks, c.seed);
  return c;
}

struct DecodedBrick {
  LatticeBits active;
  std::vector<std::int64_t> samples, points;
};

template <class T>
DecodedBrick decoded_brick(const BrickCode& code, const CodingParameters& parameters, Index3 brick) {
  DecodedBrick d;
  const BrickGrid bricks = parameters.bricks();
  std::vector<T> samples(static_cast<std::size_t>(bricks.owned_box(brick).count())), points;
  if (parameters.mode == FileMode::grid)
    points.resize(static_cast<std::size_t>(bricks.closed_box(brick).count()));
  std::vector<std::uint8_t> activity;
  const auto decode_activity = [&] {
    activity.insert(activity.end(), code.activity.begin(), code.activity.end());
    RC_ASSERT(decode_brick_activity<T>(activity, samples, parameters, brick, d.active).ok());
  };
  const bool values_first = activity_follows_values(parameters);
  if (!values_first) decode_activity();
  RC_ASSERT(
      decode_brick_values<T>(code.values, d.active, parameters, brick, {samples, points, activity}).ok());
  if (values_first) decode_activity();
  d.samples.assign(samples.begin(), samples.end());
  d.points.assign(points.begin(), points.end());
  return d;
}

// Largest error and sum of squares of the decoded samples of a brick; its statistics must agree.
template <class T>
void expect_statistics(const Statistics& s, const oracle::Volume<T>& volume, const Box& owned,
                       const std::vector<std::int64_t>& decoded) {
  const std::vector<T> original = volume.cut(owned);
  RC_ASSERT(original.size() == decoded.size());
  RC_ASSERT(s.samples == original.size());
  std::int64_t worst = 0, squares = 0, sum = 0;
  for (std::size_t i = 0; i < original.size(); ++i) {
    const std::int64_t error = std::abs(std::int64_t{original[i]} - decoded[i]);
    worst = std::max(worst, error);
    squares += error * error;
    sum += original[i];
  }
  RC_ASSERT(s.max_error == static_cast<double>(worst));
  RC_ASSERT(s.sum_squared_error == static_cast<Uint128>(squares));
  RC_ASSERT(s.sum == static_cast<double>(sum));
  RC_ASSERT(s.low == static_cast<double>(*std::min_element(original.begin(), original.end())));
  RC_ASSERT(s.high == static_cast<double>(*std::max_element(original.begin(), original.end())));
}

template <class T>
void expect_voxels_within_the_bound() {
  Coded c = random_parameters(sample_type_of<T>(), FileMode::voxels);
  CodingParameters& p = c.parameters;
  p.max_error = *rc::gen::element(0, 1, 2, 5, 40, 70000);
  p.surface_error = p.max_error > 0 && *rc::gen::inRange(0, 2) ? 0 : -1;
  const auto volume = random_volume<T>(p.dims, c.seed);
  for (std::int64_t id = 0; id < p.bricks().count(); ++id) {
    const Index3 brick = p.bricks().position(id);
    const BrickCode code = encoded_brick(volume, c.activity, p, brick);
    const DecodedBrick d = decoded_brick<T>(code, p, brick);
    const Box owned = p.bricks().owned_box(brick);
    RC_ASSERT(d.active == cut(c.activity, p.bricks().closed_box(brick)));
    RC_ASSERT(d.points.empty());
    std::size_t i = 0;
    for_each_point(owned, [&](Index3 q) {
      const std::int64_t error = std::abs(std::int64_t{volume.at(q)} - d.samples[i++]);
      RC_ASSERT(error <= static_cast<std::int64_t>(p.max_error));
      if (p.surface_error >= 0 && c.activity.test(q)) RC_ASSERT(error == 0);
    });
    expect_statistics(code.statistics, volume, owned, d.samples);
  }
}

RC_GTEST_PROP(BrickCodec, EveryVoxelIsWithinTheBound, ()) {
  expect_voxels_within_the_bound<std::uint8_t>();
  expect_voxels_within_the_bound<std::int8_t>();
  expect_voxels_within_the_bound<std::uint16_t>();
  expect_voxels_within_the_bound<std::int16_t>();
}

// The values of all voxels of a grid, computed from the whole volume: an inactive point is the mean of the
// ends of its base edge, in double precision, which is exact for these sizes.
template <class T>
std::vector<std::int64_t> interpolated(const oracle::Volume<T>& volume, const LatticeBits& active,
                                       const CodingParameters& p) {
  const Box& box = active.box();
  std::vector<double> values(static_cast<std::size_t>(box.count()));
  const auto at = [&](Index3 q) -> double& { return values[static_cast<std::size_t>(box.offset(q))]; };
  for (int level = 0; level <= max_level(p.cube_size); ++level)
    for_each_point(box, [&](Index3 q) {
      const PointClass c = classify(q, p.cube_size);
      if (c.level != level) return;
      if (active.test(q)) {
        at(q) = static_cast<double>(stored_point(volume.at(q), static_cast<std::int64_t>(p.point_error)));
      } else {
        const BaseEdge e = base_edge(q, c, p.cube_size);
        at(q) = (at(e.left) + at(e.right)) / 2;
      }
    });
  std::vector<std::int64_t> rounded;
  for (const double v : values) rounded.push_back(static_cast<std::int64_t>(std::floor(v + 0.5)));
  return rounded;
}

template <class T>
void expect_grid_round_trip() {
  Coded c = random_parameters(sample_type_of<T>(), FileMode::grid);
  CodingParameters& p = c.parameters;
  p.max_error = -1;
  p.point_error = *rc::gen::element(0, 1, 4, 30);
  const auto volume = random_volume<T>(p.dims, c.seed);
  const std::vector<std::int64_t> expected = interpolated(volume, c.activity, p);
  const Box padded = c.activity.box();
  std::map<std::int64_t, std::int64_t> stored;  // of active points, as the first brick has them
  for (std::int64_t id = 0; id < p.bricks().count(); ++id) {
    const Index3 brick = p.bricks().position(id);
    const Box closed = p.bricks().closed_box(brick), owned = p.bricks().owned_box(brick);
    const BrickCode code = encoded_brick(volume, c.activity, p, brick);
    const DecodedBrick d = decoded_brick<T>(code, p, brick);
    RC_ASSERT(d.active == cut(c.activity, closed));
    std::size_t i = 0;
    for_each_point(closed, [&](Index3 q) {
      const std::int64_t value = d.points[i++];
      if (!d.active.test(q)) {
        RC_ASSERT(value == 0);
        return;
      }
      RC_ASSERT(std::abs(value - std::int64_t{volume.at(q)}) <= static_cast<std::int64_t>(p.point_error));
      // All other bricks that have the point store the same value.
      RC_ASSERT(stored.emplace(padded.offset(q), value).first->second == value);
    });
    i = 0;
    for_each_point(owned, [&](Index3 q) {
      RC_ASSERT(d.samples[i++] == expected[static_cast<std::size_t>(padded.offset(q))]);
    });
    expect_statistics(code.statistics, volume, owned, d.samples);
  }
}

RC_GTEST_PROP(BrickCodec, AGridComesBackWithEqualSharedFaces, ()) {
  expect_grid_round_trip<std::uint8_t>();
  expect_grid_round_trip<std::int8_t>();
  expect_grid_round_trip<std::uint16_t>();
  expect_grid_round_trip<std::int16_t>();
}

// Statistics of all bricks together count every point of the domain once.
bool is_counted_once(const LatticeBits& activity, const CodingParameters& p) {
  Statistics total, expected;
  for_each_point(activity.box(), [&](Index3 q) {
    if (activity.test(q)) ++expected.active[static_cast<std::size_t>(classify(q, p.cube_size).level)];
  });
  for (std::int64_t id = 0; id < p.bricks().count(); ++id) {
    const Index3 brick = p.bricks().position(id);
    count_active(cut(activity, p.bricks().closed_box(brick)), p, brick, total);
  }
  return total.active == expected.active;
}

RC_GTEST_PROP(CountActive, EqualsALiteralCountByLevel, ()) {
  const Coded c = random_parameters(SampleType::uint8, FileMode::voxels);
  RC_ASSERT(is_counted_once(c.activity, c.parameters));
}

TEST(CountActive, HoldsForLargeRootCubes) {
  for (const int s : {64, 128}) {
    const CodingParameters p{.dims = {2 * s + 1, s + 1, s + 1}, .cube_size = s, .brick_edge = 1};
    EXPECT_TRUE(is_counted_once(random_activity_of(p.domain(), 500, 1), p)) << s;
  }
}

// The bound is compared with what was measured, whatever coder made the brick.
TEST(CheckBound, AllowsTheBoundAndNoMore) {
  CodingParameters p{.dims = {4, 4, 4}, .max_error = 5};
  Statistics measured;
  measured.max_error = 5;
  EXPECT_NO_THROW(check_bound(measured, p));
  for (const double error : {5.5, 6.0, double{INFINITY}, double{NAN}}) {
    measured.max_error = error;
    EXPECT_THROW(check_bound(measured, p), std::logic_error) << error;
  }
  p.surface_error = 2;
  measured.max_error = 5;
  EXPECT_NO_THROW(check_bound(measured, p));
  p.max_error = 0;
  p.surface_error = -1;
  measured.max_error = 0.25;
  EXPECT_THROW(check_bound(measured, p), std::logic_error);
  p.max_error = -1;  // none
  EXPECT_NO_THROW(check_bound(measured, p));
  p.mesh_error = 3;
  measured.mesh_error = 3;
  EXPECT_NO_THROW(check_bound(measured, p));
  measured.mesh_error = 3.5;
  EXPECT_THROW(check_bound(measured, p), std::logic_error);
}

// As if a coder had decoded a sample further away: statistics of a brick are added to those that are there.
TEST(CheckBound, ABrickWhoseErrorIsBeyondItIsNotEncoded) {
  for (const SampleType type : {SampleType::uint8, SampleType::int16, SampleType::int32, SampleType::float32})
    with_sample_type(type, [&](auto zero) {
      using T = decltype(zero);
      const CodingParameters p{
          .dims = {5, 4, 3}, .type = type, .cube_size = 4, .brick_edge = 1, .max_error = 2};
      std::vector<T> samples;
      for (int i = 0; i < 5 * 4 * 3; ++i) samples.push_back(static_cast<T>(i * i % 97));
      const Box box = samples_to_encode(p, {0, 0, 0});
      const LatticeBits activity = random_activity_of(p.domain(), 0, 1);
      const Box closed = p.bricks().closed_box({0, 0, 0});
      std::vector<T> of_brick(static_cast<std::size_t>(box.count()));
      std::size_t i = 0;
      for_each_point(box, [&](Index3 q) {
        of_brick[i++] = samples[static_cast<std::size_t>(q.x + 5 * (q.y + 4 * q.z))];
      });
      BrickCode code;
      code.statistics.max_error = 2;
      EXPECT_NO_THROW(
          encode_brick(Samples<T>{box, of_brick.data()}, cut(activity, closed), p, {0, 0, 0}, code));
      BrickCode wrong;
      wrong.statistics.max_error = 3;
      EXPECT_THROW(encode_brick(Samples<T>{box, of_brick.data()}, cut(activity, closed), p, {0, 0, 0}, wrong),
                   std::logic_error);
    });
}

// Broken activity bytes give another conforming set; the values after them must still decode or be refused.
TEST(BrickCodec, DamagedBricksNeverCrash) {
  for (const FileMode mode : {FileMode::voxels, FileMode::grid}) {
    CodingParameters p{.dims = {14, 17, 11},
                       .type = SampleType::int16,
                       .mode = mode,
                       .cube_size = 8,
                       .brick_edge = 2,
                       .max_level = 9,
                       .max_error = mode == FileMode::voxels ? 3.0 : -1.0,
                       .surface_error = mode == FileMode::voxels ? 1.0 : -1.0};
    const auto volume = random_volume<std::int16_t>(p.dims, 1);
    const LatticeBits activity = random_activity_of(p.domain(), 80, 1);
    const BrickCode code = encoded_brick(volume, activity, p, {0, 0, 0});
    std::mt19937_64 random(5);
    const auto damaged = [&](std::vector<std::uint8_t> bytes) {
      const auto kind = random() % 3;
      if (kind == 0) bytes.resize(random() % (bytes.size() + 9));
      if (kind == 1)
        for (int k = 0; k < 2; ++k)
          bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
      if (kind == 2)
        for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
      return bytes;
    };
    for (int i = 0; i < 300; ++i) {
      LatticeBits active;
      std::vector<std::uint8_t> carried;
      std::vector<std::int16_t> samples(static_cast<std::size_t>(p.bricks().owned_box({0, 0, 0}).count())),
          points(static_cast<std::size_t>(p.bricks().closed_box({0, 0, 0}).count()));
      const bool values_first = activity_follows_values(p);
      const auto decode_activity = [&] {
        static_cast<void>(
            decode_brick_activity<std::int16_t>(damaged(code.activity), samples, p, {0, 0, 0}, active).ok());
      };
      if (!values_first) decode_activity();
      static_cast<void>(decode_brick_values<std::int16_t>(i % 2 ? code.values : damaged(code.values), active,
                                                          p, {0, 0, 0}, {samples, points, carried})
                            .ok());
      if (values_first) decode_activity();
    }
  }
}

}  // namespace
}  // namespace tagrid
