// The check of the type and byte order of headerless samples: it finds wrong ones, and does not suspect right
// ones.
#include "pipeline/raw/likelier_reading.h"

#include <cmath>
#include <cstring>
#include <functional>
#include <random>

#include "io/bytes/little_endian.h"
#include "io/formats/table/open_volume.h"
#include "stages/phantom/phantom.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

constexpr SampleType all_types[] = {SampleType::uint8,   SampleType::int8,   SampleType::uint16,
                                    SampleType::int16,   SampleType::uint32, SampleType::int32,
                                    SampleType::float32, SampleType::float64};

class LikelierReadings : public TemporaryFolder {
 protected:
  /// The bytes of a phantom, in a file.
  std::string phantom(SampleType type, bool big_endian, std::uint64_t seed = 1) const {
    std::string bytes;
    with_sample_type(type, [&](auto zero) {
      using T = decltype(zero);
      std::vector<T> slice(static_cast<std::size_t>(dims_.x * dims_.y));
      for (std::int64_t z = 0; z < dims_.z; ++z) {
        phantom_slice<T>(dims_, seed, z, slice);
        if (big_endian)
          swap_bytes_of_samples(reinterpret_cast<std::byte*>(slice.data()), slice.size(), sizeof(T));
        bytes.append(reinterpret_cast<const char*>(slice.data()), slice.size() * sizeof(T));
      }
    });
    file("v.raw", bytes);
    return bytes;
  }
  /// The file with value(i) as sample i.
  template <class T>
  void write(const std::function<T(std::int64_t)>& value) const {
    std::string bytes;
    for (std::int64_t i = 0; i < dims_.x * dims_.y * dims_.z; ++i) {
      const T v = value(i);
      bytes.append(reinterpret_cast<const char*>(&v), sizeof v);
    }
    file("v.raw", bytes);
  }
  /// The result for the file when this type is given; its dims are made to fit.
  std::optional<LikelierReading> reading(SampleType type, bool big_endian) const {
    RawDescription raw;
    const auto bytes = static_cast<std::int64_t>(std::filesystem::file_size(path("v.raw")));
    raw.dims = {bytes / static_cast<std::int64_t>(size_of(type)) / (dims_.y * dims_.z), dims_.y, dims_.z};
    raw.type = type;
    raw.big_endian = big_endian;
    return likelier_reading(path("v.raw"), raw);
  }

  const Index3 dims_ = {200, 150, 8};
};

TEST_F(LikelierReadings, CleanVolumesOfEveryTypeAreNotSuspected) {
  for (const SampleType type : all_types)
    for (const bool big_endian : {false, true})
      for (const std::uint64_t seed : {1, 2, 3}) {
        phantom(type, big_endian, seed);
        EXPECT_FALSE(reading(type, big_endian)) << name_of(type) << " " << big_endian << " " << seed;
      }
}

TEST_F(LikelierReadings, BytesInTheWrongOrderAreSuspected) {
  for (const SampleType type : all_types)
    for (const bool big_endian : {false, true}) {
      if (size_of(type) == 1) continue;
      phantom(type, big_endian);
      const auto found = reading(type, !big_endian);
      ASSERT_TRUE(found) << name_of(type) << " " << big_endian;
      EXPECT_EQ(found->sample_bytes, size_of(type)) << name_of(type);
      EXPECT_EQ(found->big_endian, big_endian) << name_of(type);
    }
}

TEST_F(LikelierReadings, AnotherSizeOfSamplesIsSuspected) {
  for (const SampleType type : all_types)
    for (const SampleType said : all_types) {
      // Small integers have the same bytes and zeros between them in any size.
      if (size_of(type) == size_of(said) || type == SampleType::int32 || type == SampleType::uint32) continue;
      phantom(type, false);
      const auto found = reading(said, false);
      ASSERT_TRUE(found) << name_of(type) << " as " << name_of(said);
      EXPECT_NE(found->sample_bytes, size_of(said)) << name_of(type) << " as " << name_of(said);
    }
}

TEST_F(LikelierReadings, IntegersAndFloatsAreNotTakenForEachOther) {
  phantom(SampleType::float32, false);
  for (const SampleType said : {SampleType::int32, SampleType::uint32}) {
    const auto found = reading(said, false);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->type, SampleType::float32);
  }
  phantom(SampleType::uint32, false);
  const auto found = reading(SampleType::float32, false);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->type, SampleType::int32);
}

TEST_F(LikelierReadings, SmallNumbersInTheWrongOrderAreSuspected) {
  std::mt19937 random(1);
  write<std::uint16_t>([&](std::int64_t) { return random() % 250 + random() % 50; });
  EXPECT_FALSE(reading(SampleType::uint16, false));
  EXPECT_TRUE(reading(SampleType::uint16, true));
}

// Stretches at equal distances would all lie in the air beside the body.
TEST_F(LikelierReadings, TheOtherSignIsSuspectedAlsoIfSlicesArePowersOfTwo) {
  for (const std::int64_t edge : {64, 128, 256}) {
    const Index3 dims = {edge, edge, edge};
    std::string bytes;
    std::vector<std::int16_t> slice(static_cast<std::size_t>(dims.x * dims.y));
    for (std::int64_t z = 0; z < dims.z; ++z) {
      phantom_slice<std::int16_t>(dims, 1, z, slice);
      bytes.append(reinterpret_cast<const char*>(slice.data()), slice.size() * sizeof slice[0]);
    }
    file("v.raw", bytes);
    const auto found = likelier_reading(path("v.raw"), {.dims = dims, .type = SampleType::uint16});
    ASSERT_TRUE(found) << edge;
    EXPECT_EQ(found->type, SampleType::int16);
    EXPECT_FALSE(likelier_reading(path("v.raw"), {.dims = dims, .type = SampleType::int16}));
  }
}

TEST_F(LikelierReadings, TheOtherSignIsSuspected) {
  // Tissue is around 0: air, and noise of 20.
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 20);
  write<std::int16_t>([&](std::int64_t i) {
    return static_cast<std::int16_t>(std::lround((i % dims_.x < 60 ? -1000 : 30) + noise(random)));
  });
  EXPECT_FALSE(reading(SampleType::int16, false));
  const auto found = reading(SampleType::uint16, false);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->type, SampleType::int16);
  EXPECT_FALSE(found->big_endian);
  // Brightness around the middle of the type.
  std::string bytes = content("v.raw");
  for (std::size_t i = 1; i < bytes.size(); i += 2) bytes[i] = static_cast<char>(bytes[i] ^ 0x80);
  file("v.raw", bytes);
  EXPECT_FALSE(reading(SampleType::uint16, false));
  const auto unsigned_one = reading(SampleType::int16, false);
  ASSERT_TRUE(unsigned_one);
  EXPECT_EQ(unsigned_one->type, SampleType::uint16);
}

TEST_F(LikelierReadings, MasksAndCutOffBrightnessHaveNoOtherSign) {
  std::mt19937 random(1);
  for (const bool is_mask : {true, false}) {
    write<std::uint16_t>([&](std::int64_t i) {
      const bool is_bright = (i % dims_.x / 7 + i / dims_.x / 5) % 2 != 0;
      return static_cast<std::uint16_t>(is_bright ? 65535 : is_mask ? 0 : random() % 3000);
    });
    EXPECT_FALSE(reading(SampleType::uint16, false)) << is_mask;
  }
}

// Fibres or grains, whose brightness was stretched to fill the type.
TEST_F(LikelierReadings, TwoPhasesThatFillTheTypeHaveNoOtherSign) {
  std::mt19937 random(1);
  for (const double size : {5.0, 9.0, 24.0})
    for (const double sigma : {2.0, 8.0}) {
      std::normal_distribution<double> noise(0, sigma);
      const auto wave = [&](std::int64_t n) {
        return std::sin(6.2832 * (static_cast<double>(n) + 0.3) / size);
      };
      const auto brightness = [&](std::int64_t i) {
        const double sum = wave(i % dims_.x) + wave(i / dims_.x % dims_.y) + wave(i / (dims_.x * dims_.y));
        return std::clamp((sum > 0 ? 245 : 10) + noise(random), 0.0, 255.0);
      };
      write<std::uint8_t>([&](std::int64_t i) { return static_cast<std::uint8_t>(brightness(i)); });
      EXPECT_FALSE(reading(SampleType::uint8, false)) << size << " " << sigma;
      write<std::uint16_t>([&](std::int64_t i) { return static_cast<std::uint16_t>(257 * brightness(i)); });
      EXPECT_FALSE(reading(SampleType::uint16, false)) << size << " " << sigma;
    }
}

// Volumes that are unusual, but right.
TEST_F(LikelierReadings, OddVolumesAreNotSuspected) {
  const auto count = static_cast<std::size_t>(dims_.x * dims_.y * dims_.z);
  std::mt19937_64 random(1);
  const auto at = [&](std::size_t i, int axis) {
    const auto n = static_cast<std::int64_t>(i);
    return static_cast<int>(axis == 0   ? n % dims_.x
                            : axis == 1 ? n / dims_.x % dims_.y
                                        : n / (dims_.x * dims_.y));
  };
  const std::pair<const char*, std::function<double(std::size_t)>> odd[] = {
      {"constant", [](std::size_t) { return 7; }},
      {"noise", [&](std::size_t) { return static_cast<double>(random() % 120); }},
      {"few bits of noise", [&](std::size_t) { return static_cast<double>(random() % 2); }},
      {"noise around 0", [&](std::size_t) { return static_cast<double>(random() % 41) - 20; }},
      {"mask", [&](std::size_t i) { return at(i, 0) / 9 % 2 != at(i, 1) / 9 % 2; }},
      {"labels",
       [&](std::size_t i) { return (at(i, 0) / 9 * 37 + at(i, 1) / 7 * 11 + at(i, 2) / 5 * 5) % 100; }},
      {"ramp", [&](std::size_t i) { return at(i, 0) + at(i, 1); }},
      {"one spot", [&](std::size_t i) { return i == count / 2 ? 100 : 0; }},
      {"stripes", [&](std::size_t i) { return i % 2 ? 100 : 3; }},
      {"padding",
       [&](std::size_t i) { return at(i, 0) < 12 ? -128 : 20 + static_cast<double>(random() % 9); }}};
  for (const auto& [name, value] : odd)
    for (const SampleType type : all_types) {
      // Without a sign, noise around 0 is noise at both ends of the type, which is not right.
      const bool has_sign =
          type != SampleType::uint8 && type != SampleType::uint16 && type != SampleType::uint32;
      if (std::string(name) == "noise around 0" && !has_sign) continue;
      with_sample_type(type, [&, &value = value](auto zero) {
        using T = decltype(zero);
        write<T>([&](std::int64_t i) {
          const double d = value(static_cast<std::size_t>(i));
          return std::is_integral_v<T> ? static_cast<T>(static_cast<std::int64_t>(d)) : static_cast<T>(d);
        });
      });
      EXPECT_FALSE(reading(type, false)) << name << " as " << name_of(type);
    }
}

/// True if at least a hundredth of all samples lies within 200 on either side of 0.
bool has_both_signs(VolumeSource& volume) {
  double below = 0, above = 0, count = 0;
  read_to_end(volume, [&](std::span<std::byte> bytes) {
    for (std::size_t i = 0; i < bytes.size(); i += 2, ++count) {
      std::int16_t v;
      std::memcpy(&v, bytes.data() + i, 2);
      below += v < 0 && v >= -200;
      above += v >= 0 && v < 200;
    }
  });
  return below > count / 100 && above > count / 100;
}

TEST_F(LikelierReadings, RealVolumesAreNotSuspected) {
  const std::filesystem::path folder = std::filesystem::path(TAGRID_SOURCE_DIR) / "../shared/data";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".nhdr") continue;
    const auto volume = open_volume(entry.path().string());
    const std::string samples = volume->files().back();
    std::ifstream header(entry.path());
    const std::string text{std::istreambuf_iterator<char>(header), {}};
    RawDescription raw{.dims = volume->info().dims,
                       .type = volume->info().type,
                       .big_endian = text.find("endian: big") != text.npos};
    EXPECT_FALSE(likelier_reading(samples, raw)) << samples;
    if (raw.type == SampleType::int16 && has_both_signs(*volume)) {
      raw.type = SampleType::uint16;
      const auto found = likelier_reading(samples, raw);
      ASSERT_TRUE(found) << samples << " as uint16";
      EXPECT_EQ(found->type, SampleType::int16) << samples;
      raw.type = SampleType::int16;
    }
    if (size_of(raw.type) == 1) continue;
    raw.big_endian = !*raw.big_endian;
    EXPECT_TRUE(likelier_reading(samples, raw)) << samples;
  }
}

TEST_F(LikelierReadings, WhatCannotBeReadSoIsNotLookedAt) {
  phantom(SampleType::int16, true);
  RawDescription raw{.dims = dims_, .type = SampleType::int16};
  EXPECT_TRUE(likelier_reading(path("v.raw"), raw));
  raw.dims.z -= 1;
  EXPECT_FALSE(likelier_reading(path("v.raw"), raw)) << "the size does not fit";
  EXPECT_FALSE(likelier_reading("-", raw));
}

}  // namespace
}  // namespace tagrid
