#include "io/volume/rows_of_slices.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/support/volume_in_memory.h"

namespace tagrid {
namespace {

constexpr Index3 dims{3, 4, 5};
constexpr SourceTraits in_slices = {.again = true, .any_rows = false, .whole_slices = true, .memory = 1000};

Box rows(std::int64_t y_low, std::int64_t y_high, std::int64_t z) {
  return {{0, y_low, z}, {dims.x - 1, y_high, z}};
}

class RowsOfSlices : public ::testing::Test {
 protected:
  RowsOfSlices() {
    auto memory = std::make_unique<VolumeInMemory>(dims, in_slices);
    memory_ = memory.get();
    source_ = rows_of_slices(std::move(memory));
  }

  VolumeInMemory* memory_;
  std::unique_ptr<VolumeSource> source_;
};

TEST_F(RowsOfSlices, AreThoseOfTheVolumeInAnyOrder) {
  for (const std::int64_t z : {4, 0, 1, 3, 2})
    for (std::int64_t low = 3; low >= 0; --low)
      for (std::int64_t high = low; high <= 3; ++high)
        EXPECT_EQ(rows_of(*source_, rows(low, high, z)), numbers_in(dims, rows(low, high, z)));
  for (const auto& [first, count] : memory_->reads()) {
    EXPECT_EQ(first % 12, 0) << "a slice is read from its beginning";
    EXPECT_EQ(count, 12) << "and whole";
  }
}

TEST_F(RowsOfSlices, SamplesMayBeginAndEndWithinSlices) {
  std::vector<std::int16_t> samples(60);
  auto* out = reinterpret_cast<std::byte*>(samples.data());
  for (const std::int64_t count : {7, 29, 24}) {
    source_->read_samples(out, count);
    out += 2 * count;
  }
  source_->finish();
  EXPECT_EQ(samples, numbers_in(dims, Box::of_size(dims)));
  EXPECT_TRUE(memory_->finished());
}

TEST_F(RowsOfSlices, OnlyWhatIsNotTheNextSliceIsSought) {
  for (const std::int64_t z : {0, 1, 2, 1, 2, 4}) rows_of(*source_, rows(1, 2, z));
  EXPECT_EQ(memory_->seeks(), (std::vector<std::int64_t>{1, 4}));
}

TEST_F(RowsOfSlices, WhatFollowsTheLastRowIsLookedAt) {
  rows_of(*source_, rows(2, 3, 4));
  source_->finish();
  EXPECT_TRUE(memory_->finished());
  source_->seek_slice(5);
  memory_->goes_on = true;
  EXPECT_THROW(source_->finish(), BrokenInput);
}

TEST(SlicesThatAreKept, AreReadOnceForAllRowsOfAStretch) {
  auto memory = std::make_unique<VolumeInMemory>(dims, in_slices);
  const VolumeInMemory& reads = *memory;
  const auto source = rows_of_slices(std::move(memory), 3);
  EXPECT_EQ(source->traits().memory, 1000U + 4 * 24);
  const auto read = [&](std::int64_t low, std::int64_t high) {
    for (std::int64_t y = 0; y < 4; ++y)
      for (std::int64_t z = low; z <= high; ++z)
        EXPECT_EQ(rows_of(*source, rows(y, y, z)), numbers_in(dims, rows(y, y, z)));
  };
  read(0, 2);
  EXPECT_EQ(reads.reads().size(), 3U);
  read(2, 4);  // the third one is still there
  // That a stretch has begun is known when its second row of samples begins: until then, its new slices are not kept.
  EXPECT_EQ(reads.reads().size(), 3U + 2 + 2);
  read(3, 4);
  EXPECT_EQ(reads.reads().size(), 3U + 2 + 2);
  read(0, 1);  // later ones stay, and one goes
  EXPECT_EQ(rows_of(*source, rows(0, 3, 4)), numbers_in(dims, rows(0, 3, 4)));
}

TEST(SlicesThatAreKept, AreThoseOfALaterStretchAtOnce) {
  auto memory = std::make_unique<VolumeInMemory>(dims, in_slices);
  const VolumeInMemory& reads = *memory;
  const auto source = rows_of_slices(std::move(memory), 2);
  for (const std::int64_t z : {0, 1, 3, 4, 3, 4})
    EXPECT_EQ(rows_of(*source, rows(1, 2, z)), numbers_in(dims, rows(1, 2, z)));
  EXPECT_EQ(reads.reads().size(), 4U);
}

TEST(SlicesThatAreKept, AreAsManyAsMayBe) {
  auto memory = std::make_unique<VolumeInMemory>(dims, in_slices);
  const VolumeInMemory& reads = *memory;
  const auto source = rows_of_slices(std::move(memory), 3);
  for (std::int64_t y = 0; y < 4; ++y)
    for (std::int64_t z = 0; z < 5; ++z)
      EXPECT_EQ(rows_of(*source, rows(y, y, z)), numbers_in(dims, rows(y, y, z)));
  EXPECT_EQ(reads.reads().size(), 5U + 3 * 2);
}

TEST(SlicesThatAreKept, HideNothingThatFollowsThem) {
  auto memory = std::make_unique<VolumeInMemory>(dims, in_slices);
  VolumeInMemory& end = *memory;
  const auto source = rows_of_slices(std::move(memory), 3);
  rows_of(*source, rows(0, 0, 4));
  rows_of(*source, rows(0, 0, 1));
  rows_of(*source, rows(3, 3, 4));
  end.goes_on = true;
  EXPECT_THROW(source->finish(), BrokenInput);
}

TEST_F(RowsOfSlices, TakeTheMemoryOfASliceMore) {
  EXPECT_TRUE(source_->traits().any_rows);
  EXPECT_FALSE(source_->traits().whole_slices);
  EXPECT_EQ(source_->traits().memory, 1000U + 24);
  EXPECT_EQ(source_->files(), memory_->files());
  EXPECT_EQ(source_->info().nrrd_fields, memory_->info().nrrd_fields);
}

TEST(VolumeSource, RowsOfWholeSlicesAreRefused) {
  VolumeInMemory source(dims, in_slices);
  std::vector<std::byte> out(24);
  source.read_slices(out.data(), 1);
  EXPECT_THROW(source.read_rows(out.data(), rows(0, 2, 1)), std::logic_error);
}

TEST(VolumeSource, IsReadToItsEndInPieces) {
  constexpr Index3 large{1000, 900, 3};
  for (const bool whole : {false, true}) {
    VolumeInMemory source(large, {.again = false, .any_rows = false, .whole_slices = whole, .memory = 0});
    std::int64_t count = 0;
    read_to_end(source, [&](std::span<const std::byte> samples) {
      std::int16_t first;
      std::memcpy(&first, samples.data(), 2);
      EXPECT_EQ(first, static_cast<std::int16_t>(count));
      count += static_cast<std::int64_t>(samples.size() / 2);
      EXPECT_LE(samples.size(), whole ? 1800000U : std::size_t{1} << 20);
    });
    EXPECT_EQ(count, 2700000);
    EXPECT_TRUE(source.finished());
  }
}

}  // namespace
}  // namespace tagrid
