// Samples of a source: placed in its files, and spooled.
#include <gmock/gmock.h>

#include <filesystem>
#include <random>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/metadata/text.h"
#include "io/samples/file_samples.h"
#include "io/samples/slices_in_files.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volume_in_memory.h"

namespace tagrid {
namespace {

class Placed : public TemporaryFolder {
 protected:
  static VolumeInfo info(Index3 dims, SampleType type) { return {dims, type}; }
};

/// A volume whose slices lie in several files, with gaps, in either byte order, also with gaps between rows and from
/// the bottom up.
TEST_F(Placed, AnyRowsAreWhatLiesThere) {
  std::mt19937_64 random(1);
  const auto below = [&](std::uint64_t n) { return static_cast<std::int64_t>(random() % n); };
  for (const SampleType type :
       {SampleType::uint8, SampleType::int16, SampleType::float32, SampleType::float64}) {
    const Index3 dims{1 + below(9), 1 + below(7), 1 + below(30)};
    const std::size_t sample = size_of(type);
    const auto slice = static_cast<std::size_t>(dims.x * dims.y) * sample;
    std::string truth;
    std::vector<std::string> files;
    std::vector<SliceRun> runs;
    for (std::int64_t z = 0; z < dims.z;) {
      SliceRun run{files.size(), random() % 50, 1 + below(static_cast<std::uint64_t>(dims.z - z)), 0,
                   random() % 2 == 0};
      const std::size_t row = static_cast<std::size_t>(dims.x) * sample;
      if (random() % 2 == 0) {
        run.row_step = row + random() % 5;
        run.bottom_up = random() % 2 == 0;
      }
      const std::size_t between = run.row_step == 0 ? row : run.row_step;
      const std::size_t span = between * static_cast<std::size_t>(dims.y - 1) + row;
      run.step = random() % 2 == 0 ? span : span + random() % 20;
      std::string bytes(run.offset + static_cast<std::size_t>(run.slices) * run.step + 7, '\0');
      for (char& byte : bytes) byte = static_cast<char>(random());
      for (std::int64_t i = 0; i < run.slices; ++i) {
        std::string there;
        for (std::int64_t y = 0; y < dims.y; ++y)
          there += bytes.substr(run.offset + static_cast<std::size_t>(i) * run.step +
                                    static_cast<std::size_t>(run.bottom_up ? dims.y - 1 - y : y) * between,
                                row);
        if (run.big_endian)
          swap_bytes_of_samples(reinterpret_cast<std::byte*>(there.data()), slice / sample, sample);
        truth += there;
      }
      files.push_back(file("f" + std::to_string(files.size()), bytes));
      z += run.slices;
      runs.push_back(run);
    }
    const auto source = placed_samples({.info = info(dims, type), .files = files}, runs);
    ASSERT_TRUE(source->traits().any_rows && source->traits().again && !source->traits().whole_slices);
    std::string all(truth.size(), '\0');
    source->read_slices(reinterpret_cast<std::byte*>(all.data()), dims.z);
    source->finish();
    ASSERT_EQ(all, truth);
    EXPECT_EQ(source->bytes_read(), truth.size());
    // Once more, from the same files: while somebody else reads, and after they have lost their names.
    const auto again = placed_samples_again(source->facts());
    for (const std::string& name : files) std::filesystem::remove(name);
    std::string same(truth.size(), '\0');
    again->read_slices(reinterpret_cast<std::byte*>(same.data()), dims.z);
    ASSERT_EQ(same, truth);
    for (int i = 0; i < 50; ++i) {
      const std::int64_t z = below(static_cast<std::uint64_t>(dims.z)),
                         y = below(static_cast<std::uint64_t>(dims.y));
      const Box rows{{0, y, z}, {dims.x - 1, y + below(static_cast<std::uint64_t>(dims.y - y)), z}};
      const std::size_t size = static_cast<std::size_t>(dims.x * (rows.high.y - rows.low.y + 1)) * sample;
      std::string part(size, '\0');
      source->read_rows(reinterpret_cast<std::byte*>(part.data()), rows);
      ASSERT_EQ(part, truth.substr(
                          static_cast<std::size_t>(z) * slice + static_cast<std::size_t>(y * dims.x) * sample,
                          size));
    }
  }
}

TEST_F(Placed, FilesThatEndEarlyAreRefusedBeforeAnythingIsRead) {
  const std::string name = file("a", std::string(100, 'x'));
  const auto open = [&](const SliceRun& run) {
    return placed_samples({.info = info({5, 2, 3}, SampleType::int16), .files = {name}}, {run});
  };
  EXPECT_NO_THROW(open({0, 40, 3, 20}));
  EXPECT_NO_THROW(open({0, 80, 3, 0}));
  EXPECT_THROW(open({0, 41, 3, 20}), BrokenInput);
  EXPECT_THROW(open({0, 40, 3, 21}), BrokenInput);
  EXPECT_THROW(open({0, ~std::uint64_t{0}, 3, 20}), BrokenInput);
  EXPECT_THROW(open({0, 40, 3, ~std::uint64_t{0} / 2}), BrokenInput);
  EXPECT_THROW(open({0, ~std::uint64_t{0} - 30, 3, 0}), BrokenInput);
  const auto with_rows = [](std::uint64_t offset, std::uint64_t row_step) {
    return SliceRun{
        .offset = offset, .slices = 3, .step = row_step + 10, .row_step = row_step, .bottom_up = true};
  };
  EXPECT_NO_THROW(open(with_rows(4, 22)));
  EXPECT_THROW(open(with_rows(5, 22)), BrokenInput);
  EXPECT_THROW(open(with_rows(4, ~std::uint64_t{0} - 3)), BrokenInput);
  std::filesystem::remove(name);
  EXPECT_THROW(open({0, 40, 3, 20}), WorldError);
}
constexpr Index3 dims{300, 200, 11};  // more than is copied at once

using SpooledTest = TemporaryFolder;

TEST_F(SpooledTest, APipeAndAVolumeOfWholeSlicesCanBeReadInAnyOrder) {
  for (const bool slices : {false, true}) {
    const SourceTraits traits = {.again = false, .any_rows = false, .whole_slices = slices, .memory = 5};
    const auto source = spooled(std::make_unique<VolumeInMemory>(dims, traits), folder_.string());
    EXPECT_TRUE(source->traits().again && source->traits().any_rows);
    EXPECT_FALSE(source->traits().whole_slices);
    EXPECT_EQ(source->traits().memory, 0U);
    for (const std::int64_t z : {10, 3, 4, 0}) {
      const Box rows = {{0, 7, z}, {dims.x - 1, 7 + z, z}};
      EXPECT_EQ(rows_of(*source, rows), numbers_in(dims, rows));
    }
    source->seek_slice(dims.z);
    source->finish();
    source->rewind();
    EXPECT_EQ(rows_of(*source, {{0, 0, 0}, {299, 0, 0}})[1], 1);
  }
}

TEST_F(SpooledTest, WhatElseIsKnownStays) {
  const auto source = spooled(std::make_unique<VolumeInMemory>(dims, SourceTraits{}), folder_.string());
  EXPECT_EQ(source->files(), (std::vector<std::string>{"header", "numbers"}));
  EXPECT_EQ(text_of(source->info().metadata), "content: numbers\n");
  EXPECT_TRUE(source->facts().holds_other_bytes && source->facts().headerless);
  rows_of(*source, {{0, 0, 0}, {299, 0, 0}});
  EXPECT_EQ(source->bytes_read(), 77U) << "of the files, not of the copy";
  EXPECT_EQ(names(), std::vector<std::string>{}) << "the copy has no name";
}

TEST_F(SpooledTest, AVolumeThatGoesOnIsBroken) {
  auto source = std::make_unique<VolumeInMemory>(dims, SourceTraits{});
  source->goes_on = true;
  EXPECT_THROW(spooled(std::move(source), folder_.string()), BrokenInput);
}

}  // namespace
}  // namespace tagrid
