// Values that are few: what a brick is written as, that it comes back, and what it takes.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <set>

#include "stages/entropy/rans_coder.h"
#include "stages/sample/numbers.h"
#include "stages/values/few/find.h"
#include "stages/values/few/labels.h"
#include "stages/values/few/table.h"
#include "stages/values/voxels/codec.h"
#include "stages/values/wide/codec.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

constexpr std::uint8_t affine_kind = 6, table_kind = 7, labels_kind = 8;

template <class T>
auto brick_of_few(Index3 size, double error, Effort effort) {
  if constexpr (is_wide<T>)
    return WideBrick{Box::of_size(size), nullptr, {error, -1}, effort};
  else
    return VoxelBrick{Box::of_size(size), nullptr, {integer_bound<T>(error), -1}, effort};
}

/// Codes a brick, and checks that it comes back within its bound, whole and by its first slices. Returns its
/// bytes.
template <class T>
std::vector<std::uint8_t> bytes_of_few_values(const std::vector<T>& samples, Index3 size, double error = 0,
                                              Effort effort = Effort::normal) {
  const auto brick = brick_of_few<T>(size, error, effort);
  std::vector<std::uint8_t> bytes, to_carry(80, 7), carried;
  std::vector<T> decoded(samples.size()), back(samples.size());
  auto pending = encode_voxels<T>(samples, brick, decoded, bytes);
  const std::optional<std::size_t> count = pending.finish(to_carry);
  EXPECT_TRUE(decode_voxels<T>(bytes, brick, back, carried).ok());
  EXPECT_EQ(carried.size(), count.value_or(0));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!identical(back[i], decoded[i])) ADD_FAILURE() << "what the encoder expects, at " << i;
    const bool right = error == 0 || !is_finite(samples[i])
                           ? identical(back[i], samples[i])
                           : within(static_cast<double>(back[i]), static_cast<double>(samples[i]), error);
    if (!right) {
      ADD_FAILURE() << "sample " << i << " is beyond its bound";
      break;
    }
  }
  const auto slice = static_cast<std::size_t>(size.x * size.y);
  std::vector<T> first(slice * static_cast<std::size_t>((size.z + 1) / 2));
  EXPECT_TRUE(decode_voxels<T>(bytes, brick, first, carried).ok());
  EXPECT_EQ(std::memcmp(first.data(), back.data(), first.size() * sizeof(T)), 0);
  return bytes;
}

constexpr Index3 few_size{40, 33, 20};

/// CT of few levels, 0 .. 99.
std::vector<int> levels(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<int> result;
  for (const auto [x, y, z] : points_of(few_size))
    result.push_back(static_cast<int>((x - 20) * (x - 20) + (y - 16) * (y - 16) < 120 ? 60 + z : 10) +
                     static_cast<int>(random() % 20));
  return result;
}

template <class T, class F>
std::vector<T> mapped(const std::vector<int>& from, F f) {
  std::vector<T> result;
  for (const int v : from) result.push_back(static_cast<T>(f(v)));
  return result;
}

TEST(FewValues, RescaledIntegersTakeTheBytesOfTheirNumbers) {
  const auto from = levels(1);
  for (const Effort effort : {Effort::normal, Effort::fast, Effort::best}) {
    const std::size_t plain =
        bytes_of_few_values(mapped<std::uint16_t>(from, [](int v) { return v; }), few_size, 0, effort).size();
    // Ties are rounded the same way whether numbers are mirrored or not, so a few contexts differ.
    const std::size_t most = plain + plain / 500;
    const auto times = [](int n) { return [n](int v) { return n * v - 5 * n; }; };
    const auto check = [&](const auto& samples) {
      const auto bytes = bytes_of_few_values(samples, few_size, 0, effort);
      EXPECT_EQ(bytes[0], affine_kind);
      EXPECT_LE(bytes.size(), most);
    };
    check(mapped<std::uint16_t>(from, [](int v) { return v * 257; }));
    check(mapped<std::int16_t>(from, times(8)));
    check(mapped<std::int8_t>(mapped<int>(from, [](int v) { return v - 50; }),
                              [](int v) { return v * 2 / 2 * 2; }));
    check(mapped<std::int32_t>(from, times(1000003)));
    check(
        mapped<std::uint32_t>(from, [](int v) { return 4294967295U - 3000000U * static_cast<unsigned>(v); }));
  }
}

TEST(FewValues, ATableTakesLittleMoreThanItsNumbers) {
  const auto from = levels(2);
  std::mt19937_64 random(3);
  const auto any_table = [&](auto type, auto next) {
    std::set<decltype(type)> values;
    while (values.size() < 200) values.insert(next());
    return std::vector<decltype(type)>(values.begin(), values.end());
  };
  const std::size_t plain =
      bytes_of_few_values(mapped<std::uint16_t>(from, [](int v) { return v; }), few_size).size();
  const auto check = [&](const auto& samples, std::size_t of_table) {
    for (const Effort effort : {Effort::normal, Effort::best}) {
      const auto bytes = bytes_of_few_values(samples, few_size, 0, effort);
      EXPECT_EQ(bytes[0], table_kind);
      EXPECT_LE(bytes.size(), plain + of_table);
    }
  };
  const auto through = [&](const auto& table) {
    return mapped<std::decay_t<decltype(table[0])>>(
        from, [&](int v) { return table[static_cast<std::size_t>(v)]; });
  };
  check(through(any_table(std::uint16_t{}, [&] { return static_cast<std::uint16_t>(random()); })), 250);
  check(through(any_table(std::int32_t{}, [&] { return static_cast<std::int32_t>(random()); })), 500);
  check(through(any_table(std::uint32_t{}, [&] { return static_cast<std::uint32_t>(random()); })), 500);
  check(through(any_table(float{},
                          [&] { return std::ldexp(static_cast<float>(random() % 65536) - 3e4f, -20) / 3; })),
        500);
  check(
      through(any_table(double{}, [&] { return std::ldexp(static_cast<double>(random()) - 1e19, -9) / 3; })),
      1000);
}

// Floats made from integers: their table is nearly a progression.
TEST(FewValues, ScaledFloatsTakeLittleMoreThanTheirNumbers) {
  const auto from = levels(3);
  const std::size_t plain =
      bytes_of_few_values(mapped<std::uint16_t>(from, [](int v) { return v; }), few_size).size();
  const auto check = [&](const auto& samples) {
    const auto bytes = bytes_of_few_values(samples, few_size);
    EXPECT_EQ(bytes[0], table_kind);
    EXPECT_LE(bytes.size(), plain + 120);
  };
  check(mapped<float>(from, [](int v) { return static_cast<float>(v) / 255.0f; }));
  check(mapped<float>(from, [](int v) { return static_cast<float>(v) * 0.1f - 3.3f; }));
  check(mapped<double>(from, [](int v) { return v * 0.1; }));
  check(mapped<double>(from, [](int v) { return v / 3.0 - 17; }));
}

TEST(FewValues, WhatIsNotFiniteComesBack) {
  const auto from = levels(4);
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  const auto samples = mapped<float>(from, [&](int v) {
    if (v == 10) return nan;
    if (v == 11) return -infinity;
    if (v == 12) return -0.0f;
    if (v == 13) return 0.0f;
    if (v == 14) return -nan;
    if (v == 15) return infinity;
    return static_cast<float>(v) * 0.1f;
  });
  EXPECT_EQ(bytes_of_few_values(samples, few_size)[0], table_kind);
  bytes_of_few_values(samples, few_size, 1e-5);
  bytes_of_few_values(samples, few_size, 0.3);
}

// A bound is divided by the step, if that is coarser than the bound itself.
TEST(FewValues, BoundsAreKeptAndUsed) {
  const auto from = levels(5);
  const auto scaled = mapped<std::uint16_t>(from, [](int v) { return v * 257; });
  const std::size_t exact = bytes_of_few_values(scaled, few_size, 0).size();
  EXPECT_EQ(bytes_of_few_values(scaled, few_size, 100).size(), exact);
  for (const double error : {1.0, 20.0, 257.0, 300.0, 600.0, 5000.0}) {
    const auto bytes = bytes_of_few_values(scaled, few_size, error);
    EXPECT_LE(bytes.size(), exact);
  }
  for (const double error : {1.0, 6.0, 40.0, 900.0})
    for (const Effort effort : {Effort::normal, Effort::fast, Effort::best}) {
      bytes_of_few_values(mapped<std::int32_t>(from, [](int v) { return v * v * 700; }), few_size, error,
                          effort);
      bytes_of_few_values(mapped<std::uint16_t>(from, [](int v) { return v * v * 6; }), few_size, error,
                          effort);
      bytes_of_few_values(mapped<float>(from, [](int v) { return v * v * 0.7; }), few_size, error / 64,
                          effort);
    }
}

// Values in pairs: within the bound there is one for each pair.
TEST(FewValues, ATableHasTheFewestEntriesWithinTheBound) {
  std::vector<std::uint16_t> samples;
  const auto from = levels(6);
  for (std::size_t i = 0; i < from.size(); ++i)
    samples.push_back(static_cast<std::uint16_t>(from[i] * from[i] * 6 + static_cast<int>(i % 2)));
  const auto few =
      find_few<std::uint16_t>(samples, few_size, {1, 1}, *std::min_element(samples.begin(), samples.end()),
                              *std::max_element(samples.begin(), samples.end()));
  ASSERT_TRUE(few);
  std::set<int> different(from.begin(), from.end());
  EXPECT_EQ(few->entries.size(), different.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    ASSERT_LE(std::abs(int{few->entries[few->numbers[i]]} - int{samples[i]}), 1);
}

template <class T>
std::vector<T> blobs(Index3 size, std::uint64_t seed, std::size_t count) {
  std::mt19937_64 random(seed);
  std::vector<T> result(static_cast<std::size_t>(size.x * size.y * size.z));
  for (std::size_t blob = 0; blob < count; ++blob) {
    const auto any = [&](std::int64_t n) {
      return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(n));
    };
    const Index3 c{any(size.x), any(size.y), any(size.z)};
    const std::int64_t radius = 3 + any(8);
    const auto id = static_cast<T>(random() >> 8);
    std::size_t i = 0;
    for (const auto [x, y, z] : points_of(size)) {
      const std::int64_t dx = x - c.x, dy = y - c.y, dz = z - c.z;
      if (dx * dx + dy * dy + dz * dz < radius * radius) result[i] = id;
      ++i;
    }
  }
  return result;
}

TEST(Labels, OfEveryTypeComeBackInFewBytes) {
  const Index3 size{64, 50, 40};
  const auto check = [&](const auto& samples) {
    for (const Effort effort : {Effort::normal, Effort::fast, Effort::best}) {
      const auto bytes = bytes_of_few_values(samples, size, 0, effort);
      EXPECT_EQ(bytes[0], labels_kind);
      EXPECT_LE(bytes.size(), samples.size() / 20);
    }
  };
  check(blobs<std::uint8_t>(size, 1, 30));
  check(blobs<std::int8_t>(size, 2, 1));
  check(blobs<std::uint16_t>(size, 3, 40));
  check(blobs<std::int16_t>(size, 4, 20));
  check(blobs<std::uint32_t>(size, 5, 40));
  check(blobs<std::int32_t>(size, 6, 40));
  std::vector<float> floats;
  for (const std::uint32_t v : blobs<std::uint32_t>(size, 7, 10))
    floats.push_back(static_cast<float>(v) * 1e-3f);
  check(floats);
}

TEST(Labels, TakeNoMoreThanAnEventForEachVoxel) {
  std::mt19937 random(1);
  const Index3 size{64, 64, 8};
  std::vector<std::uint16_t> noise(static_cast<std::size_t>(size.x * size.y * size.z));
  for (std::uint16_t& v : noise) v = static_cast<std::uint16_t>(random() % 1000);
  std::vector<std::uint8_t> bytes;
  EXPECT_FALSE(append_labels(noise, size, 1000, bytes));
  EXPECT_TRUE(bytes.empty());
}

// Any labels come back as they are, and the first slices alone.
RC_GTEST_PROP(Labels, AnyComeBack, (std::uint32_t seed)) {
  std::mt19937 random(seed);
  const auto edge = [] { return *rc::gen::element<std::int64_t>(1, 2, 3, 5, 17, 63, 64, 65, 130); };
  const Index3 size{edge(), std::min<std::int64_t>(edge(), 17), std::min<std::int64_t>(edge(), 5)};
  const std::uint32_t count = *rc::gen::element<std::uint32_t>(2, 3, 5, 256, 257, 5000, 65536);
  const std::uint32_t rarely = *rc::gen::element<std::uint32_t>(2, 20, 300);
  std::vector<std::uint16_t> labels(static_cast<std::size_t>(size.x * size.y * size.z)), back(labels.size());
  std::uint16_t last = 0;
  for (std::uint16_t& v : labels) {
    if (random() % rarely == 0) last = static_cast<std::uint16_t>(random() % count);
    v = last;
  }
  std::vector<std::uint8_t> bytes;
  if (!append_labels(labels, size, count, bytes)) return;
  RC_ASSERT(decode_labels(bytes, size, count, back).ok());
  RC_ASSERT(back == labels);
  back.resize(static_cast<std::size_t>(size.x * size.y));
  RC_ASSERT(decode_labels(bytes, size, count, back).ok());
  RC_ASSERT(std::equal(back.begin(), back.end(), labels.begin()));
}

template <class T>
void any_table_comes_back() {
  std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
  const auto count = *rc::gen::element<std::size_t>(2, 3, 10, 300);
  const int kind = *rc::gen::inRange(0, 4);
  std::set<std::int64_t> keys;
  for (std::size_t i = 0; i < count; ++i) {
    T value;
    const auto any = static_cast<BitsOf<T>>(random());
    if constexpr (std::is_integral_v<T>)
      value = static_cast<T>(kind == 0 ? any : kind == 1 ? any % 50 * 5 : i);
    else
      value = kind == 0   ? std::bit_cast<T>(any)
              : kind == 1 ? static_cast<T>(static_cast<double>(any % 1000) * 0.1 - 7)
              : kind == 2 ? static_cast<T>(static_cast<double>(i) / 3)
                          : static_cast<T>(std::ldexp(1.0, static_cast<int>(any % 100)));
    keys.insert(key_of(value));
  }
  if (keys.size() < 2) return;
  std::vector<T> values, back;
  for (const std::int64_t key : keys) values.push_back(from_key<T>(key));
  std::vector<std::uint8_t> bytes;
  append_table<T>(values, bytes);
  bytes.push_back(77);
  std::span<const std::uint8_t> rest(bytes);
  RC_ASSERT(take_table<T>(rest, 4 * values.size(), back).ok());
  RC_ASSERT(rest.size() == 1u);
  RC_ASSERT(std::equal(values.begin(), values.end(), back.begin(), back.end(), identical<T>));
  rest = bytes;
  if (values.size() > 2) RC_ASSERT(!take_table<T>(rest, 4 * values.size() - 1, back).ok());
  // Damaged ones are refused, or are tables.
  bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
  rest = bytes;
  if (take_table<T>(rest, 65536, back).ok())
    for (std::size_t i = 1; i < back.size(); ++i) RC_ASSERT(key_of(back[i - 1]) < key_of(back[i]));
}
RC_GTEST_PROP(Table, OfAnyTypeComesBack, ()) {
  any_table_comes_back<std::uint8_t>();
  any_table_comes_back<std::int16_t>();
  any_table_comes_back<std::uint32_t>();
  any_table_comes_back<std::int32_t>();
  any_table_comes_back<float>();
  any_table_comes_back<double>();
}

// Smooth values, noise and dense ones are written as before.
TEST(FewValues, WhatIsNotFewIsAsItIs) {
  std::mt19937 random(1);
  std::vector<std::uint16_t> ct, noise;
  std::vector<float> floats;
  for (const auto [x, y, z] : points_of(few_size)) {
    ct.push_back(static_cast<std::uint16_t>(1000 + 20 * x + y * y + random() % 100));
    noise.push_back(static_cast<std::uint16_t>(random()));
    floats.push_back(std::sin(static_cast<float>(random())));
  }
  EXPECT_LT(bytes_of_few_values(ct, few_size)[0], affine_kind);
  EXPECT_LT(bytes_of_few_values(noise, few_size)[0], affine_kind);
  EXPECT_LT(bytes_of_few_values(floats, few_size)[0], affine_kind);
}

// Damaged bytes are refused, or decoded to something.
TEST(FewValues, DamagedBytesAreSafe) {
  std::mt19937 random(1);
  const auto from = levels(7);
  const auto check = [&](const auto& samples, Index3 size) {
    using T = std::decay_t<decltype(samples[0])>;
    const auto bytes = bytes_of_few_values(samples, size);
    const auto brick = brick_of_few<T>(size, 0, Effort::normal);
    std::vector<T> back(samples.size());
    std::vector<std::uint8_t> carried;
    for (std::size_t cut = 0; cut < bytes.size(); cut += 1 + cut / 8)
      EXPECT_FALSE(decode_voxels<T>(std::span(bytes).first(cut), brick, back, carried).ok());
    for (int i = 0; i < 300; ++i) {
      auto damaged = bytes;
      const std::size_t at =
          random() % 2 ? random() % std::min<std::size_t>(40, bytes.size()) : random() % bytes.size();
      damaged[at] ^= static_cast<std::uint8_t>(1 + random() % 255);
      (void)decode_voxels<T>(damaged, brick, back, carried).ok();
    }
  };
  check(mapped<std::uint16_t>(from, [](int v) { return v * 257; }), few_size);
  check(mapped<std::uint16_t>(from, [](int v) { return v * v * 6; }), few_size);
  check(mapped<float>(from, [](int v) { return static_cast<float>(v) * 0.1f; }), few_size);
  check(blobs<std::uint32_t>({33, 20, 10}, 1, 9), {33, 20, 10});
}

// Two bounds: affine bricks divide both; tables keep the tighter one.
TEST(FewValues, TwoBoundsAreKept) {
  const auto from = levels(8);
  const Box box = Box::of_size(few_size);
  LatticeBits active(box);
  std::mt19937 random(2);
  for (const auto [x, y, z] : points_of(few_size))
    if (random() % 3 == 0) active.set({x, y, z});
  const auto check = [&](const auto& samples, auto bounds) {
    using T = std::decay_t<decltype(samples[0])>;
    const BrickOfVoxels<decltype(bounds)> brick{box, &active, bounds, Effort::normal};
    std::vector<std::uint8_t> bytes, carried;
    std::vector<T> decoded(samples.size()), back(samples.size());
    encode_voxels<T>(samples, brick, decoded, bytes).finish();
    ASSERT_TRUE(decode_voxels<T>(bytes, brick, back, carried).ok());
    std::size_t i = 0;
    for (const auto [x, y, z] : points_of(few_size)) {
      const auto bound =
          static_cast<double>(active.test({x, y, z}) ? bounds.surface_error : bounds.max_error);
      ASSERT_TRUE(identical(back[i], decoded[i]));
      ASSERT_TRUE(bound == 0 ? identical(back[i], samples[i])
                             : within(static_cast<double>(back[i]), static_cast<double>(samples[i]), bound));
      ++i;
    }
  };
  for (const std::int64_t surface : {0, 100, 300}) {
    check(mapped<std::uint16_t>(from, [](int v) { return v * 257; }), VoxelBounds{800, surface});
    check(mapped<std::uint16_t>(from, [](int v) { return v * v * 6; }), VoxelBounds{800, surface});
    const WideBounds wide{800, static_cast<double>(surface)};
    check(mapped<std::int32_t>(from, [](int v) { return v * 100003; }), wide);
    check(mapped<std::uint32_t>(from, [](int v) { return v * v * 100003; }), wide);
    check(mapped<float>(from, [](int v) { return v * v * 0.1f; }),
          WideBounds{0.8, static_cast<double>(surface) / 1000});
    check(mapped<double>(from, [](int v) { return v * 0.1; }),
          WideBounds{0.8, static_cast<double>(surface) / 1000});
  }
}

}  // namespace
}  // namespace tagrid
