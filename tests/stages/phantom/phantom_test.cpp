#include "stages/phantom/phantom.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>
#include <vector>

#include "stages/sample/sample_type.h"

namespace tagrid {
namespace {

template <class T>
std::vector<T> slice(const Index3& dims, std::uint64_t seed, std::int64_t z) {
  std::vector<T> samples(static_cast<std::size_t>(dims.x * dims.y));
  phantom_slice<T>(dims, seed, z, samples);
  return samples;
}

/// FNV-1a of the samples' bits, low byte first.
template <class T>
std::uint64_t hash_of(const std::vector<T>& samples) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (T sample : samples) {
    std::uint64_t bits = 0;
    if constexpr (std::is_same_v<T, float>)
      bits = std::bit_cast<std::uint32_t>(sample);
    else
      bits = static_cast<std::uint64_t>(sample);
    for (std::size_t i = 0; i < sizeof(T); ++i) hash = (hash ^ ((bits >> (8 * i)) & 255)) * 0x100000001b3u;
  }
  return hash;
}

constexpr Index3 dims{150, 130, 400};

// Other tests and measurements identify the phantom by its parameters, so the samples must never change.
TEST(Phantom, SamplesAreTheSameForEver) {
  std::uint64_t int16_hash = 0, float_hash = 0;
  for (std::int64_t z = 0; z < dims.z; z += 57) {
    int16_hash = int16_hash * 31 + hash_of(slice<std::int16_t>(dims, 7, z));
    float_hash = float_hash * 31 + hash_of(slice<float>(dims, 7, z));
  }
  EXPECT_EQ(int16_hash, 6075871685596550064u);
  EXPECT_EQ(float_hash, 12286356024146349226u);
}

TEST(Phantom, ASliceDoesNotDependOnTheHeightOrOnOtherSlices) {
  const auto first = slice<std::int16_t>(dims, 1, 100);
  slice<std::int16_t>(dims, 1, 7);
  EXPECT_EQ(slice<std::int16_t>(dims, 1, 100), first);
  EXPECT_EQ(slice<std::int16_t>({dims.x, dims.y, 100000}, 1, 100), first);
  EXPECT_NE(slice<std::int16_t>(dims, 2, 100), first);
}

TEST(Phantom, NoSliceComesTwice) {
  std::set<std::uint64_t> hashes;
  const Index3 tall{40, 40, std::int64_t{1} << 40};
  for (std::int64_t z = 0; z < 300; ++z) hashes.insert(hash_of(slice<std::int16_t>(tall, 1, z)));
  for (std::int64_t z = tall.z - 300; z < tall.z; ++z)
    hashes.insert(hash_of(slice<std::int16_t>(tall, 1, z)));
  EXPECT_EQ(hashes.size(), 600u);
}

TEST(Phantom, TypesShowTheSame) {
  const auto hu = slice<std::int16_t>(dims, 1, 100);
  const auto u16 = slice<std::uint16_t>(dims, 1, 100);
  const auto u8 = slice<std::uint8_t>(dims, 1, 100);
  const auto i8 = slice<std::int8_t>(dims, 1, 100);
  const auto i32 = slice<std::int32_t>(dims, 1, 100);
  const auto u32 = slice<std::uint32_t>(dims, 1, 100);
  const auto f32 = slice<float>(dims, 1, 100);
  const auto f64 = slice<double>(dims, 1, 100);
  for (std::size_t i = 0; i < hu.size(); ++i) {
    ASSERT_EQ(u16[i], hu[i] + 1024);
    ASSERT_EQ(i32[i], hu[i]);
    ASSERT_EQ(u32[i], u16[i]);
    ASSERT_EQ(i8[i], u8[i] - 128);
    ASSERT_LE(std::abs(std::min(255.0, u16[i] / 10.0) - u8[i]), 0.56);
    ASSERT_LE(std::abs(f32[i] - static_cast<float>(hu[i])), 0.5001f);
    ASSERT_EQ(f64[i], f32[i]);
  }
}

TEST(Phantom, ShowsPaddingAirLungTissueAndBone) {
  std::int64_t padding = 0, air = 0, lung = 0, tissue = 0, bone = 0, all = 0;
  for (std::int64_t z = 0; z < dims.z; z += 20)
    for (std::int16_t hu : slice<std::int16_t>(dims, 1, z)) {
      EXPECT_TRUE(hu >= -1024 && hu <= 3071) << hu;
      padding += hu == -1024;
      air += hu > -1024 && hu < -950;
      lung += hu > -900 && hu < -750;
      tissue += hu > -50 && hu < 150;
      bone += hu > 700;
      ++all;
    }
  EXPECT_GT(padding, all / 5);
  EXPECT_GT(air, all / 10);
  EXPECT_GT(lung, all / 50);
  EXPECT_GT(tissue, all / 5);
  EXPECT_GT(bone, all / 200);
}

TEST(Phantom, NoiseIsCorrelatedInTheSliceAndNotBetweenSlices) {
  // Air beside the patient.
  const Index3 large{512, 512, 10};
  const auto a = slice<double>(large, 1, 0), b = slice<double>(large, 1, 1);
  double variance = 0, along_x = 0, along_z = 0;
  for (std::int64_t y = 20; y < 60; ++y)
    for (std::int64_t x = 220; x < 290; ++x) {
      const auto i = static_cast<std::size_t>(y * large.x + x);
      const double here = a[i] + 1000, right = a[i + 1] + 1000, above = b[i] + 1000;
      variance += here * here;
      along_x += here * right;
      along_z += here * above;
    }
  EXPECT_GT(along_x / variance, 0.5);
  EXPECT_LT(std::abs(along_z / variance), 0.15);
}

TEST(Phantom, AnySizeIsPossible) {
  for (const Index3& size : {Index3{1, 1, 1}, Index3{2, 1, 3}, Index3{1, 50, 2}, Index3{1000, 3, 2}})
    for (std::int64_t z = 0; z < size.z; ++z)
      EXPECT_EQ(slice<std::uint8_t>(size, 1, z), slice<std::uint8_t>(size, 1, z));
}

}  // namespace
}  // namespace tagrid
