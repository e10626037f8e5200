// The wavelet is undone exactly, its bands tile the brick, and a coded brick comes back as the encoder said.
#include "stages/values/transform/transform.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <random>

#include "stages/sample/coding_parameters.h"
#include "stages/sample/numbers.h"
#include "stages/values/transform/filter.h"
#include "stages/values/transform/lifting.h"
#include "stages/values/transform/shape.h"
#include "stages/values/voxels/codec.h"
#include "stages/values/wide/codec.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

constexpr std::array<Split, 4> splits = {Split::dyadic, Split::z1, Split::z2, Split::z4};
constexpr Index3 sizes[] = {{1, 1, 1},    {2, 3, 1},    {4, 1, 1},           {1, 1, 9},   {3, 4, 5},
                            {7, 6, 4},    {16, 16, 16}, {17, 33, 2},         {5, 64, 30}, {129, 3, 8},
                            {65, 10, 63}, {512, 2, 5},  {longest_line, 3, 2}};

std::size_t count_of(Index3 size) { return static_cast<std::size_t>(size.x * size.y * size.z); }

TEST(Transform, IsUndoneExactlyForAnyCoefficients) {
  std::mt19937 random(1);
  for (const Index3& size : sizes)
    for (const Split split : splits) {
      const TransformShape shape = transform_shape(size, split, 64, 6);
      std::vector<std::int32_t> original(count_of(size));
      for (std::int32_t& c : original) c = static_cast<std::int32_t>(random());
      auto coefficients = original;
      transform_forward(coefficients, shape);
      transform_back(coefficients, shape);
      EXPECT_EQ(coefficients, original) << size.x << ' ' << size.y << ' ' << size.z;
    }
}

TEST(Transform, BandsTileTheBrick) {
  for (const Index3& size : sizes)
    for (const Split split : splits) {
      const TransformShape shape = transform_shape(size, split, 64, 6);
      std::vector<int> covered(count_of(size));
      for (const Band& band : shape.bands)
        for (const Index3 at : points_of(Box{band.low, band.low + band.size - Index3{1, 1, 1}}))
          ++covered[static_cast<std::size_t>(Box::of_size(size).offset(at))];
      EXPECT_EQ(std::ranges::count(covered, 1), static_cast<std::ptrdiff_t>(covered.size()));
      EXPECT_TRUE(shape.bands[0].is_mean);
      EXPECT_EQ(shape.bands[0].orientation, 0);
    }
}

TEST(Transform, BandsLookOnlyAtBandsBeforeThem) {
  for (const Index3& size : sizes)
    for (const Split split : splits) {
      const TransformShape shape = transform_shape(size, split, 64, 6);
      for (int i = 0; i < static_cast<int>(shape.bands.size()); ++i) {
        const Band& band = shape.bands[static_cast<std::size_t>(i)];
        EXPECT_LT(band.parent, i);
        // What lies at the same place is there, or at most one step beyond the last coefficient.
        const auto near = [&](int other, Index3 shift) {
          if (other == no_band) return;
          for (int axis = 0; axis < 3; ++axis)
            EXPECT_LE((band.size[axis] - 1) >> shift[axis],
                      shape.bands[static_cast<std::size_t>(other)].size[axis]);
        };
        near(band.parent, band.parent_shift);
        for (std::size_t s = 0; s < 3; ++s) {
          EXPECT_LT(band.siblings[s], i);
          near(band.siblings[s], {0, 0, band.sibling_shift[s]});
        }
      }
    }
}

// An oracle: the steps of the wavelet as they are written, on real numbers, for a line.
std::vector<double> undone(const std::vector<double>& low, const std::vector<double>& high) {
  std::vector<double> x(low.size() + high.size());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = i % 2 == 0 ? low[i / 2] : high[i / 2];
  const auto n = static_cast<std::int64_t>(x.size());
  const auto step = [&](std::int64_t first, double factor) {
    for (std::int64_t i = first; i < n; i += 2) {
      const std::int64_t left = i > 0 ? i - 1 : i + 1, right = i + 1 < n ? i + 1 : i - 1;
      x[static_cast<std::size_t>(i)] -=
          factor * (x[static_cast<std::size_t>(left)] + x[static_cast<std::size_t>(right)]);
    }
  };
  step(0, 0.443506852043971);
  step(1, 0.882911075530934);
  step(0, -0.052980118572961);
  step(1, -1.586134342059924);
  return x;
}

TEST(Transform, IsTheWaveletOfTheBooks) {
  std::mt19937 random(2);
  for (const std::int64_t n : {4, 5, 17, 64, 301, 512})
    for (int axis = 0; axis < 3; ++axis) {
      Index3 size{1, 1, 1};
      size[axis] = n;
      const TransformShape shape = transform_shape(size, Split::dyadic, 64, 6);
      std::vector<std::int32_t> coefficients(static_cast<std::size_t>(n));
      for (std::int32_t& c : coefficients) c = static_cast<std::int32_t>(random() % 65536) - 32768;
      std::vector<double> expected(coefficients.begin(), coefficients.end());
      const auto& lengths = shape.lengths[static_cast<std::size_t>(axis)];
      for (std::size_t level = lengths.size() - 1; level > 0; --level) {
        const auto low = static_cast<std::ptrdiff_t>(lengths[level]),
                   all = static_cast<std::ptrdiff_t>(lengths[level - 1]);
        const auto joined = undone({expected.begin(), expected.begin() + low},
                                   {expected.begin() + low, expected.begin() + all});
        std::ranges::copy(joined, expected.begin());
      }
      transform_back(coefficients, shape);
      for (std::size_t i = 0; i < coefficients.size(); ++i) EXPECT_NEAR(coefficients[i], expected[i], 12);
    }
}

TEST(Transform, StepsAreInverseToTheNormsOfTheBasisFunctions) {
  const Index3 size{256, 256, 1};
  for (const Split split : {Split::dyadic, Split::z2}) {
    const TransformShape shape = transform_shape(size, split, 64 * 100, 6);
    for (const Band& band : shape.bands) {
      std::vector<std::int32_t> coefficients(count_of(size));
      Index3 middle = band.low;
      for (int axis = 0; axis < 3; ++axis) middle[axis] += band.size[axis] / 2;
      constexpr std::int32_t one = 1 << 22;
      coefficients[static_cast<std::size_t>(Box::of_size(size).offset(middle))] = one;
      transform_back(coefficients, shape);
      double squares = 0;
      for (const std::int32_t c : coefficients) squares += static_cast<double>(c) * c;
      const double norm = std::sqrt(squares) / one;
      // Steps of 100 samples in 2^-6 of a sample, in 2^-8 of that. The coarsest functions meet the faces.
      EXPECT_NEAR(band.steps[0] * norm / (100 * 64 * 256), 1, band.level > 4 ? 0.2 : 0.01) << band.level;
    }
  }
}

template <class T>
std::vector<T> any_samples(Index3 size, std::mt19937& random) {
  const auto low = std::int64_t{std::numeric_limits<T>::min()},
             high = std::int64_t{std::numeric_limits<T>::max()};
  const int kind = *rc::gen::inRange(0, 5);
  const std::int64_t amplitude = *rc::gen::element<std::int64_t>(1, 5, 40, high - low);
  std::vector<T> samples;
  for (const auto [x, y, z] : points_of(size)) {
    const auto noise = static_cast<std::int64_t>(random() % static_cast<std::uint32_t>(amplitude + 1));
    std::int64_t v = low + noise;
    if (kind == 1) v = (x + y + z) % 2 ? low : high;
    if (kind == 2)
      v = static_cast<std::int64_t>(60 * std::sin(0.2 * static_cast<double>(x + 2 * y)) *
                                    std::cos(0.1 * static_cast<double>(z))) +
          noise / 8;
    if (kind == 3) v = (x - 5) * (x - 5) + (y - 7) * (y - 7) + z * z < 40 ? 100 : 3;
    if (kind == 4) v = random() % 50 ? 17 : noise;
    samples.push_back(static_cast<T>(std::clamp(v, low, high)));
  }
  return samples;
}

FilterWeights any_filter(std::mt19937& random) {
  FilterWeights weights;
  const int most = random() % 4 ? 60 : most_filter_weight;
  for (std::int16_t& w : weights)
    w = static_cast<std::int16_t>(static_cast<int>(random() % static_cast<unsigned>(2 * most + 1)) - most);
  return weights;
}

// What a decoder returns is what the encoder said, within the bound; also of the first slices.
template <class T>
void comes_back() {
  std::mt19937 random(*rc::gen::arbitrary<std::uint32_t>());
  const Index3 size = *rc::gen::elementOf(std::vector<Index3>(std::begin(sizes), std::end(sizes) - 1));
  const auto samples = any_samples<T>(size, random);
  VoxelBrick brick{Box::of_size(size), nullptr, {*rc::gen::element<std::int64_t>(0, 1, 7, 100, 65535), -1}};
  brick.transform_step =
      *rc::gen::element<std::uint32_t>(1, 17, 64, 200, 3000, 100000, largest_transform_step) *
      least_transform_step;
  brick.effort = *rc::gen::element(Effort::normal, Effort::best);
  if (*rc::gen::arbitrary<bool>()) brick.filter = any_filter(random);
  std::vector<T> decoded(samples.size()), back(samples.size());
  std::vector<std::uint8_t> bytes, carried;
  encode_voxels<T>(samples, brick, decoded, bytes).finish();
  RC_ASSERT(decode_voxels<T>(bytes, brick, back, carried).ok());
  RC_ASSERT(back == decoded);
  for (std::size_t i = 0; i < samples.size(); ++i)
    RC_ASSERT(std::abs(std::int64_t{back[i]} - samples[i]) <= brick.bounds.max_error);
  std::vector<T> first(static_cast<std::size_t>(size.x * size.y * ((size.z + 1) / 2)));
  RC_ASSERT(decode_voxels<T>(bytes, brick, first, carried).ok());
  RC_ASSERT(std::equal(first.begin(), first.end(), back.begin()));
}
RC_GTEST_PROP(Transform, BricksComeBack, ()) {
  comes_back<std::uint8_t>();
  comes_back<std::int8_t>();
  comes_back<std::uint16_t>();
  comes_back<std::int16_t>();
}

// Soft tissue, bone and air, with noise.
std::vector<std::int16_t> body(Index3 size) {
  std::mt19937 random(5);
  std::vector<std::int16_t> samples;
  for (const auto [x, y, z] : points_of(size)) {
    const auto dx = static_cast<double>(x - size.x / 2), dy = static_cast<double>(y - size.y / 2);
    const double r = std::sqrt(dx * dx + dy * dy) + static_cast<double>(z) / 5;
    const int value = r > 20 ? -1000 : r > 8 && r < 10 ? 1200 : 40;
    samples.push_back(static_cast<std::int16_t>(value + static_cast<int>(random() % 31) - 15));
  }
  return samples;
}
constexpr Index3 body_size{48, 45, 32};

// Wide samples keep the bound and what is no number, whether their numbers are narrow or not.
template <class T>
void wide_comes_back() {
  std::mt19937 random(*rc::gen::arbitrary<std::uint32_t>());
  const Index3 size = *rc::gen::elementOf(std::vector<Index3>(std::begin(sizes), std::end(sizes) - 1));
  const double scale = *rc::gen::element(1.0, 3e4, std::is_integral_v<T> ? 17.0 : 1e-3);
  const int special = *rc::gen::inRange(0, 20);
  std::vector<T> samples;
  for (const std::uint8_t sample : any_samples<std::uint8_t>(size, random))
    samples.push_back(static_cast<T>(sample * scale));
  if constexpr (std::is_floating_point_v<T>)
    if (special < 4) samples[random() % samples.size()] = special < 2 ? NAN : -INFINITY;
  WideBrick brick{Box::of_size(size), nullptr, {scale * *rc::gen::element(1.0, 7.0, 1000.0), -1}};
  brick.transform_step = kept_step(scale * *rc::gen::element(0.01, 0.7, 5.0, 300.0), sample_type_of<T>());
  if (*rc::gen::arbitrary<bool>()) brick.filter = any_filter(random);
  std::vector<T> decoded(samples.size()), back(samples.size());
  std::vector<std::uint8_t> bytes, carried;
  encode_voxels<T>(samples, brick, decoded, bytes).finish();
  RC_ASSERT(decode_voxels<T>(bytes, brick, back, carried).ok());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    RC_ASSERT(identical(back[i], decoded[i]));
    RC_ASSERT(identical(back[i], samples[i]) ||
              within(static_cast<double>(back[i]), static_cast<double>(samples[i]), brick.bounds.max_error));
  }
}
RC_GTEST_PROP(Transform, WideBricksComeBack, ()) {
  wide_comes_back<std::int32_t>();
  wide_comes_back<std::uint32_t>();
  wide_comes_back<float>();
  wide_comes_back<double>();
}

// The numbers of floats are finer than the step, so that rounding them loses nothing to speak of.
TEST(Transform, FloatsTakeTheBytesOfTheIntegersThatTheyWere) {
  const auto samples = body(body_size);
  std::vector<float> floats;
  for (const std::int16_t sample : samples) floats.push_back(static_cast<float>(sample) * 0.017f + 0.3f);
  VoxelBrick brick{Box::of_size(body_size), nullptr, {65535, -1}};
  brick.transform_step = 40;
  WideBrick wide{brick.owned, nullptr, {1e6, -1}};
  wide.transform_step = kept_step(40 * 0.017, SampleType::float32);
  std::vector<std::int16_t> decoded(samples.size());
  std::vector<float> decoded_floats(samples.size());
  std::vector<std::uint8_t> bytes, of_floats;
  encode_voxels<std::int16_t>(samples, brick, decoded, bytes).finish();
  encode_voxels<float>(floats, wide, decoded_floats, of_floats).finish();
  EXPECT_NEAR(static_cast<double>(of_floats.size()), static_cast<double>(bytes.size()),
              0.02 * static_cast<double>(bytes.size()));
  double squares = 0, of_integers = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double error = (decoded_floats[i] - floats[i]) / 0.017, of_integer = decoded[i] - samples[i];
    squares += error * error;
    of_integers += of_integer * of_integer;
  }
  EXPECT_LT(squares, 1.02 * of_integers);
}

TEST(Transform, ErrorsFallWithTheStepAndBytesRise) {
  const auto samples = body(body_size);
  double last_rmse = INFINITY;
  std::size_t last_bytes = 0;
  for (const std::uint32_t step : {64 * 600, 64 * 300, 64 * 150, 64 * 70, 64 * 30}) {
    std::vector<std::int16_t> decoded(samples.size());
    std::vector<std::uint8_t> bytes;
    ASSERT_TRUE(encode_transform<std::int16_t>(samples, {body_size, step, 65535}, decoded, bytes));
    double squares = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) squares += std::pow(decoded[i] - samples[i], 2);
    const double rmse = std::sqrt(squares / static_cast<double>(samples.size()));
    EXPECT_LT(rmse, last_rmse);
    EXPECT_LT(rmse, step / 64.0 / 2);
    EXPECT_GT(bytes.size(), last_bytes);
    last_rmse = rmse;
    last_bytes = bytes.size();
  }
}

// The sum over all neighbours, as docs/dev/format.md has it.
TEST(Filter, IsItsFormulaForAnyNumbers) {
  std::mt19937 random(1);
  for (const Index3& size : sizes) {
    if (count_of(size) > 5000) continue;
    for (const std::uint32_t step : {1u, 63u, 64u, 4000u, largest_transform_step})
      for (const int fraction : {4, 6}) {
        const FilterWeights weights = any_filter(random);
        const std::uint64_t s = std::uint64_t{step} << fraction >> 6;
        const int shift = std::max(static_cast<int>(std::bit_width(s)) - 7, 0);
        const auto unit = static_cast<std::int64_t>(s >> shift);
        const std::array<std::int64_t, 3> limits = {4095, std::max<std::int64_t>(1, unit / 4),
                                                    std::max<std::int64_t>(1, unit / 12)};
        std::vector<std::int32_t> values(count_of(size));
        for (std::int32_t& v : values) v = static_cast<std::int32_t>(random()) >> random() % 24;
        const auto number = [&](Index3 at) {
          for (int axis = 0; axis < 3; ++axis)
            at[axis] = std::clamp<std::int64_t>(at[axis], 0, size[axis] - 1);
          const std::int64_t v = values[static_cast<std::size_t>(Box::of_size(size).offset(at))];
          return std::clamp<std::int64_t>((v + (std::int64_t{1} << shift >> 1)) >> shift, -8191, 8191);
        };
        std::vector<std::int32_t> expected;
        for (const Index3 here : points_of(size)) {
          std::int64_t sum = 512;
          for (const Index3 d : points_of(Box{{-2, -2, -2}, {2, 2, 2}})) {
            const std::array<std::int64_t, 3> away = {std::abs(d.x), std::abs(d.y), std::abs(d.z)};
            const auto is = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
              return away == std::array{x, y, z};
            };
            const int group = is(1, 0, 0)                  ? 0
                              : is(0, 1, 0)                ? 1
                              : is(0, 0, 1)                ? 2
                              : is(1, 1, 0)                ? 3
                              : is(1, 0, 1) || is(0, 1, 1) ? 4
                              : is(2, 0, 0) || is(0, 2, 0) ? 5
                              : is(0, 0, 2)                ? 6
                              : is(2, 2, 0)                ? 7
                                                           : -1;
            if (group < 0) continue;
            for (std::size_t k = 0; k < 3; ++k)
              sum += weights[8 * k + static_cast<std::size_t>(group)] *
                     std::clamp(number(here + d) - number(here), -limits[k], limits[k]);
          }
          const std::int64_t v = values[static_cast<std::size_t>(Box::of_size(size).offset(here))];
          expected.push_back(static_cast<std::int32_t>(v + (std::clamp(sum >> 10, -unit, unit) << shift)));
        }
        filter_brick(values, size, step, fraction, weights);
        EXPECT_EQ(values, expected) << size.x << ' ' << size.y << ' ' << size.z << ", step " << step;
      }
  }
}

// Weights that were fitted to a brick restore a part of what it lost, and no weights lose more than none.
TEST(Filter, MakesErrorsSmaller) {
  const auto samples = body(body_size);
  const auto squares = [&](const FilterWeights& weights, FilterSums* fit) {
    std::vector<std::int16_t> decoded(samples.size());
    std::vector<std::uint8_t> bytes;
    EXPECT_TRUE(
        encode_transform<std::int16_t>(samples, {body_size, 64 * 300, 65535, weights, fit}, decoded, bytes));
    double sum = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) sum += std::pow(decoded[i] - samples[i], 2);
    return sum;
  };
  FilterSums fit;
  const double without = squares({}, &fit);
  EXPECT_LT(squares(fitted_weights(fit), nullptr), 0.9 * without);
  FilterWeights useless;
  useless.fill(-most_filter_weight);
  EXPECT_EQ(squares(useless, nullptr), without);
}

TEST(Filter, IsFittedToBricksInAnyOrder) {
  std::mt19937 random(2);
  std::vector<FilterSums> bricks(3);
  for (FilterSums& sums : bricks) {
    std::vector<std::int32_t> values(count_of(body_size)), lacking(values.size());
    for (std::int32_t& v : values) v = static_cast<std::int32_t>(random() % 20000);
    for (std::int32_t& v : lacking) v = static_cast<std::int32_t>(random() % 200) - 100;
    add_to_sums(values, lacking, body_size, 500, 6, sums);
  }
  FilterSums forth, back;
  for (const FilterSums& sums : bricks) forth.add(sums);
  for (auto sums = bricks.rbegin(); sums != bricks.rend(); ++sums) back.add(*sums);
  EXPECT_EQ(fitted_weights(forth), fitted_weights(back));
  EXPECT_NE(fitted_weights(forth), FilterWeights{});
  EXPECT_EQ(fitted_weights({}), FilterWeights{});
}

// Faces of bricks must not be seen. If steps were not finer there, the errors of this noise would be 1.18 times those
// inside.
TEST(Transform, ErrorsAtFacesAreCloseToThoseInside) {
  constexpr std::int64_t edge = 64;
  constexpr Index3 size{edge, edge, edge};
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 1000);
  std::vector<std::int16_t> samples(count_of(size)), decoded(samples.size());
  for (std::int16_t& v : samples)
    v = static_cast<std::int16_t>(std::clamp(normal(random), -30000.0, 30000.0));
  std::vector<std::uint8_t> bytes;
  ASSERT_TRUE(encode_transform<std::int16_t>(samples, {size, 64 * 600, 65535}, decoded, bytes));
  std::array<double, 2> squares{}, counts{};  // inside, and on one face
  std::size_t i = 0;
  for (std::int64_t z = 0; z < edge; ++z)
    for (std::int64_t y = 0; y < edge; ++y)
      for (std::int64_t x = 0; x < edge; ++x, ++i) {
        std::size_t faces = 0, near = 0;
        for (const std::int64_t at : {x, y, z}) {
          const std::int64_t away = std::min(at, edge - 1 - at);
          faces += away == 0;
          near += away < 8;
        }
        if (near != faces || faces > 1) continue;
        squares[faces] += std::pow(decoded[i] - samples[i], 2);
        ++counts[faces];
      }
  const double ratio = std::sqrt(squares[1] / counts[1] / (squares[0] / counts[0]));
  EXPECT_NEAR(ratio, 1, 0.1);
}

// High bands of a constant are not quite 0, which costs nothing.
TEST(Transform, AnOffsetOfTheSamplesCostsNothing) {
  const auto samples = body(body_size);
  std::vector<std::size_t> sizes_of_code;
  for (const int offset : {1100, 30000, 64000}) {
    std::vector<std::uint16_t> moved, decoded(samples.size());
    for (const std::int16_t v : samples) moved.push_back(static_cast<std::uint16_t>(v + offset));
    std::vector<std::uint8_t> bytes;
    ASSERT_TRUE(encode_transform<std::uint16_t>(moved, {body_size, 64 * 12, 65535}, decoded, bytes));
    sizes_of_code.push_back(bytes.size());
  }
  EXPECT_EQ(sizes_of_code, std::vector(3, sizes_of_code[0]));
}

TEST(Transform, ABoundIsKeptByCorrections) {
  const auto samples = body(body_size);
  std::size_t unbounded = 0;
  for (const std::int64_t bound : {65535, 200, 60, 20}) {
    std::vector<std::int16_t> decoded(samples.size());
    std::vector<std::uint8_t> bytes;
    ASSERT_TRUE(encode_transform<std::int16_t>(samples, {body_size, 64 * 60, bound}, decoded, bytes));
    std::int64_t most = 0;
    for (std::size_t i = 0; i < samples.size(); ++i)
      most = std::max<std::int64_t>(most, std::abs(decoded[i] - samples[i]));
    EXPECT_LE(most, bound);
    if (bound == 65535) unbounded = bytes.size();
    EXPECT_GE(bytes.size(), unbounded);
  }
}

TEST(Transform, ValuesThatAreFewOrOneTakeTheirOwnCode) {
  VoxelBrick brick{Box::of_size(body_size), nullptr, {100, -1}};
  brick.transform_step = 50;
  std::vector<std::int16_t> samples(count_of(body_size), 7), decoded(samples.size());
  std::vector<std::uint8_t> bytes;
  encode_voxels<std::int16_t>(samples, brick, decoded, bytes).finish();
  EXPECT_EQ(bytes.size(), 3);
  // Labels are exact, though errors of 100 are allowed.
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = static_cast<std::int16_t>(i % static_cast<std::size_t>(body_size.x) > 20 ? 900 : 0);
  bytes.clear();
  encode_voxels<std::int16_t>(samples, brick, decoded, bytes).finish();
  EXPECT_LT(bytes.size(), 200);
  EXPECT_EQ(decoded, samples);
}

TEST(Transform, NoiseBelowWhichTheStepLiesIsExact) {
  std::mt19937 random(3);
  VoxelBrick brick{Box::of_size(body_size), nullptr, {100, -1}};
  brick.transform_step = least_transform_step;
  std::vector<std::uint16_t> samples(count_of(body_size)), decoded(samples.size());
  for (std::uint16_t& s : samples) s = static_cast<std::uint16_t>(random());
  std::vector<std::uint8_t> bytes;
  EXPECT_FALSE(encode_transform<std::uint16_t>(samples, {body_size, 1, 100}, decoded, bytes));
  EXPECT_TRUE(bytes.empty());
  encode_voxels<std::uint16_t>(samples, brick, decoded, bytes).finish();
  EXPECT_EQ(decoded, samples);
  EXPECT_LE(bytes.size(), 1 + 2 * samples.size());
}

TEST(Transform, DamagedBytesAreDecodedOrRefusedWithoutHarm) {
  std::mt19937 random(4);
  const auto samples = body(body_size);
  const TransformBrick brick{body_size, 64 * 40, 90};
  std::vector<std::int16_t> decoded(samples.size());
  std::vector<std::uint8_t> bytes;
  ASSERT_TRUE(encode_transform<std::int16_t>(samples, brick, decoded, bytes));
  for (std::size_t cut = 0; cut < bytes.size(); cut += 1 + cut / 4)
    EXPECT_FALSE(decode_transform<std::int16_t>(std::span(bytes).first(cut), brick, decoded).ok());
  for (int i = 0; i < 60; ++i) {
    auto damaged = bytes;
    const std::size_t at = random() % (i % 2 ? bytes.size() : 24);
    damaged[at] ^= static_cast<std::uint8_t>(1 + random() % 255);
    (void)decode_transform<std::int16_t>(damaged, brick, decoded).ok();
    for (std::uint8_t& byte : damaged) byte = static_cast<std::uint8_t>(random() % 256 | random() % 256);
    (void)decode_transform<std::int16_t>(damaged, brick, decoded).ok();
  }
  bytes.push_back(0);
  EXPECT_FALSE(decode_transform<std::int16_t>(bytes, brick, decoded).ok());
}

TEST(Transform, ATransformedBrickNeedsAStep) {
  const auto samples = body(body_size);
  VoxelBrick brick{Box::of_size(body_size), nullptr, {100, -1}};
  brick.transform_step = 40;
  std::vector<std::int16_t> decoded(samples.size());
  std::vector<std::uint8_t> bytes, carried;
  encode_voxels<std::int16_t>(samples, brick, decoded, bytes).finish();
  ASSERT_EQ(bytes[0], 9);
  brick.transform_step = 0;
  EXPECT_FALSE(decode_voxels<std::int16_t>(bytes, brick, decoded, carried).ok());
}

}  // namespace
}  // namespace tagrid
