// Slices of a volume: their lengths, and rows cut from them.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "io/metadata/lengths.h"
#include "io/metadata/text.h"
#include "io/volume/volume_source.h"
#include "tests/support/volume_in_memory.h"

namespace tagrid {
namespace {

// Units of lengths by all their names, and places that stay where they are in another unit.

std::string usual(std::string_view name) {
  const auto unit = length_unit(name);
  return unit ? std::string(unit->name) : "";
}

TEST(Lengths, AreKnownByAllTheirNames) {
  for (const char* micro :
       {"um", "UM", "\xc2\xb5m", "\xce\xbcm", "\xb5m", "micron", "Microns", "micrometer", "Micrometres"})
    EXPECT_EQ(usual(micro), "um") << micro;
  for (const char* milli : {"mm", "MM", "millimeter", "Millimetres", " mm "})
    EXPECT_EQ(usual(milli), "mm") << milli;
  for (const char* inch : {"inch", "in", "inches", "\""}) EXPECT_EQ(usual(inch), "inch") << inch;
  for (const char* angstrom : {"A", "\xc3\x85", "\xc5", "\xe2\x84\xab", "Angstroms", "ang"})
    EXPECT_EQ(usual(angstrom), "angstrom") << angstrom;
  EXPECT_EQ(usual("\\u00B5m") + usual("feet") + usual("thou") + usual("dam") + usual("fm"), "umftmildamfm");
  EXPECT_EQ(usual("cm") + usual("nm") + usual("m") + usual("Meters") + usual("km") + usual("pm"),
            "cmnmmmkmpm");
  for (const char* other : {"", "s", "Mm", "pixel", "mmHg", "furlong", "e", "1"})
    EXPECT_EQ(usual(other), "") << other;
}

TEST(Lengths, AreRoundedOnceIfOneUnitIsAWholeNumberOfTheOther) {
  const auto in_mm = [](double length, const char* unit) {
    return converted(length, *length_unit(unit), *length_unit("mm"));
  };
  EXPECT_EQ(in_mm(2500, "um"), 2.5);
  EXPECT_EQ(in_mm(0.3, "um"), 0.3 / 1000);
  EXPECT_EQ(in_mm(1.1, "m"), 1.1 * 1000);
  EXPECT_EQ(in_mm(2, "in"), 50.8);
}

Geometry geometry(const std::string& fields) { return parse_metadata(fields).geometry(); }

TEST(Lengths, InOneUnitPlacesStay) {
  const Geometry spaced = in_one_unit(geometry(
      "spacings: 0.5 2 3\nunits: \"mm\" \"cm\" \"micron\"\naxis mins: 1 1 1\ncenters: node node node\n"));
  EXPECT_EQ(spaced.spacing, (std::array{0.5, 20.0, 0.003}));
  EXPECT_EQ(spaced.origin, (std::array{1.0, 10.0, 0.001}));
  EXPECT_EQ(spaced.units, (std::array<std::string, 3>{"mm", "mm", "mm"}));
  // Units of coordinates, not of axes.
  const Geometry turned =
      in_one_unit(geometry("space dimension: 3\nspace directions: (3,4000,0) (-4,3000,0) (0,0,7)\nspace "
                           "origin: (1,2000,3)\nspace units: \"mm\" \"um\" \"mm\"\n"));
  EXPECT_EQ(turned.directions, (std::array<std::array<double, 3>, 3>{{{3, 4, 0}, {-4, 3, 0}, {0, 0, 7}}}));
  EXPECT_EQ(turned.spacing, (std::array{5.0, 5.0, 7.0}));
  EXPECT_EQ(turned.origin, (std::array{1.0, 2.0, 3.0}));
}

TEST(Lengths, NothingChangesWhereNothingIsMixedOrKnown) {
  for (const char* fields : {"spacings: 0.1 0.2 0.3\nunits: \"um\" \"micron\" \"um\"\n",
                             "spacings: 1 2 3\nunits: \"mm\" \"mm\" \"s\"\n",
                             "spacings: 1 2 3\nunits: \"mm\" \"\" \"mm\"\n", "spacings: 1 2 3\n", ""}) {
    const Geometry before = geometry(fields), after = in_one_unit(before);
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_TRUE(after.spacing[axis] == before.spacing[axis] || std::isnan(before.spacing[axis])) << fields;
  }
  EXPECT_EQ(lost_by_mixed_units(geometry("spacings: 1 2 3\nunits: \"mm\" \"cm\" \"um\"\n")), "");
  EXPECT_NE(lost_by_mixed_units(geometry("spacings: 1 2 3\nunits: \"mm\" \"cm\" \"s\"\n")), "");
  // An axis without a spacing, such as that of a single slice, needs no unit.
  const Geometry slice = geometry("spacings: 1 2 nan\nunits: \"cm\" \"cm\" \"\"\n");
  EXPECT_EQ(lost_by_mixed_units(slice), "");
  EXPECT_EQ(in_unit(slice, "mm").spacing[0], 10);
}
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
  EXPECT_EQ(source_->info().metadata, memory_->info().metadata);
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
