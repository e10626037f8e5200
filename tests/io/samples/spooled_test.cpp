#include "io/samples/spooled.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"
#include "tests/support/volume_in_memory.h"

namespace tagrid {
namespace {

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
  EXPECT_EQ(source->info().nrrd_fields, "content: numbers\n");
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
