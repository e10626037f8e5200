// Regions of a volume, read from the bricks that hold them.
#include "pipeline/reading/read_region.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstring>
#include <limits>
#include <set>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/tag/file.h"
#include "tests/support/points.h"
#include "tests/support/runs.h"
#include "tests/support/tag_in_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

constexpr Index3 dims{37, 45, 29};

EncodeOptions small_bricks(bool grid_only) {
  EncodeOptions options{.grid_only = grid_only, .max_error = 3, .cube_size = 4, .brick_edge = 2};
  return options;
}

Region any_region() {
  Region region;
  for (int axis = 0; axis < 3; ++axis) {
    const int n = static_cast<int>(dims[axis]);
    region.box.low[axis] = *rc::gen::inRange(0, n);
    region.box.high[axis] = *rc::gen::inRange(static_cast<int>(region.box.low[axis]), n);
    region.step[axis] = *rc::gen::inRange(1, 20);
  }
  return region;
}

BrickGrid bricks_of_volume() { return {{dims, 4}, 2}; }

// Calls visit(number, sample) for all samples of the region, x fastest.
template <class Visit>
void for_each_sample(const Region& region, Visit visit) {
  const Index3 n = region.shape();
  for (const auto [x, y, z] : points_of(n)) visit(Index3{x, y, z}, region.sample({x, y, z}));
}

RC_GTEST_PROP(Regions, NeedTheBricksThatOwnOneOfTheirSamplesAndNoOthers, ()) {
  const Region region = any_region();
  const BrickGrid bricks = bricks_of_volume();
  std::set<std::int64_t> owners;
  for_each_sample(region, [&](Index3, Index3 p) {
    owners.insert(bricks.id({bricks.owner(p.x), bricks.owner(p.y), bricks.owner(p.z)}));
  });
  const std::vector<std::int64_t> ids = bricks_of(region, bricks);
  RC_ASSERT(ids == std::vector<std::int64_t>(owners.begin(), owners.end()));
}

RC_GTEST_PROP(Regions, EverySampleOfThemIsOwnedOnce, ()) {
  const Region region = any_region();
  const BrickGrid bricks = bricks_of_volume();
  std::int64_t count = 0;
  for (const std::int64_t id : bricks_of(region, bricks)) {
    const Box owned = bricks.owned_box(bricks.position(id)), numbers = region.numbers_in(owned);
    RC_ASSERT(!numbers.empty());
    RC_ASSERT(owned.contains(region.sample(numbers.low)) && owned.contains(region.sample(numbers.high)));
    count += numbers.count();
  }
  const Index3 n = region.shape();
  RC_ASSERT(count == n.x * n.y * n.z);
}

RC_GTEST_PROP(Regions, ReachTheirLastSampleOfABrickInAsManySlicesAsSaid, ()) {
  const Region region = any_region();
  const BrickGrid bricks = bricks_of_volume();
  for (const std::int64_t id : bricks_of(region, bricks)) {
    const Box owned = bricks.owned_box(bricks.position(id));
    std::int64_t last = -1;
    for_each_sample(region, [&](Index3, Index3 p) {
      if (owned.contains(p)) last = std::max(last, p.z);
    });
    RC_ASSERT(slices_until(region, owned) == last - owned.low.z + 1);
  }
}

TEST(Regions, OfAnEnormousStepHaveTheFirstSampleAlone) {
  constexpr std::int64_t most = std::numeric_limits<std::int64_t>::max();
  const Region region{{{5, 6, 7}, {36, 44, 28}}, {most, most, most}};
  const BrickGrid bricks = bricks_of_volume();
  EXPECT_EQ(region.shape(), (Index3{1, 1, 1}));
  EXPECT_EQ(bricks_of(region, bricks),
            std::vector{bricks.id({bricks.owner(5), bricks.owner(6), bricks.owner(7)})});
}

class ReadRegion : public TemporaryFolder {
 protected:
  // A file in memory, and its samples as decode_volume() gives them.
  template <class T>
  void encode(bool grid_only) {
    write_nrrd(path("in.nrrd"), dims, blobs<T>(dims, 3), "spacings: 1 2 3\n");
    encode_volume(path("in.nrrd"), {}, path("file.tag"), true, small_bricks(grid_only), Resources(2));
    decode_volume(path("file.tag"), path("whole.nrrd"), format_named("nrrd"), true, Resources(2));
    source_ = std::make_shared<MemorySource>(file_content(path("file.tag")));
  }

  template <class T>
  void expect_region(const TagBricks& file, const std::vector<T>& whole, const Region& region) {
    // Files begin one step before their first samples.
    const Region on_lattice{file.parameters().domain().points_of(region.box), region.step};
    const Index3 n = region.shape();
    std::vector<T> samples(static_cast<std::size_t>(n.x * n.y * n.z));
    const auto size = static_cast<std::int64_t>(sizeof(T));
    read_region(file, on_lattice,
                {reinterpret_cast<std::byte*>(samples.data()), {size, size * n.x, size * n.x * n.y}}, 3);
    std::size_t i = 0;
    for_each_sample(region, [&](Index3, Index3 p) {
      RC_ASSERT(std::memcmp(&samples[i++], &whole[static_cast<std::size_t>(Box::of_size(dims).offset(p))],
                            sizeof(T)) == 0);
    });
  }

  std::shared_ptr<MemorySource> source_;
};

TEST_F(ReadRegion, GivesTheSamplesOfTheWholeVolume) {
  for (const bool grid_only : {false, true}) {
    encode<std::int16_t>(grid_only);
    const TagBricks file(source_);
    const auto whole = read_samples<std::int16_t>(path("whole.nrrd"));
    rc::check([&] { expect_region(file, whole, any_region()); });
  }
  encode<float>(false);
  const TagBricks file(source_);
  const auto whole = read_samples<float>(path("whole.nrrd"));
  rc::check([&] { expect_region(file, whole, any_region()); });
}

TEST_F(ReadRegion, PutsSamplesWhereStridesSay) {
  encode<std::uint8_t>(false);
  const TagBricks file(source_);
  const auto whole = read_samples<std::uint8_t>(path("whole.nrrd"));
  const Region region{{{3, 9, 2}, {20, 30, 17}}, {2, 3, 1}};
  const Index3 n = region.shape();
  // z fastest, y backwards, and a byte of room behind every sample.
  const Strides strides = {2 * n.z * n.y, -2 * n.z, 2};
  std::vector<std::uint8_t> samples(static_cast<std::size_t>(2 * n.x * n.y * n.z), 99);
  auto* first = reinterpret_cast<std::byte*>(samples.data()) + 2 * n.z * (n.y - 1);
  read_region(file, {file.parameters().domain().points_of(region.box), region.step}, {first, strides}, 2);
  for_each_sample(region, [&](Index3 number, Index3 p) {
    const auto* at = first + number.x * strides[0] + number.y * strides[1] + number.z * strides[2];
    EXPECT_EQ(std::to_integer<int>(at[0]), whole[static_cast<std::size_t>(Box::of_size(dims).offset(p))]);
    EXPECT_EQ(std::to_integer<int>(at[1]), 99);
  });
}

// Root cubes of 32 and bricks of 64, which are the defaults.
TEST_F(ReadRegion, ReadsTheBricksThatItMeetsAndNothingElse) {
  const Index3 large{129, 130, 131};
  write_nrrd(path("in.nrrd"), large, blobs<std::uint8_t>(large, 1));
  encode_volume(path("in.nrrd"), {}, path("file.tag"), true, {.grid = GridOrigin::derived}, Resources(2));
  const auto source = std::make_shared<MemorySource>(file_content(path("file.tag")));
  const TagBricks file(source);
  std::uint64_t of_opening = 0;
  for (const auto& [begin, end] : source->reads()) of_opening += end - begin;
  EXPECT_LE(of_opening, 4096 + largest_end);
  const Region region{{{40, 50, 60}, {103, 113, 123}}};
  std::vector<std::byte> samples(64 * 64 * 64);
  read_region(file, region, {samples.data(), {1, 64, 64 * 64}}, 2);
  const std::vector<std::int64_t> ids = bricks_of(region, file.parameters().bricks());
  EXPECT_EQ(ids.size(), 8U);
  std::set<std::pair<std::uint64_t, std::uint64_t>> expected;
  // The sizes of the only page, behind the last brick.
  const std::uint64_t page = file.start(26) + file.block_bytes(26);
  expected.emplace(page - 8, page + file.index().pages.at(0).sizes_bytes);
  for (const std::int64_t id : ids)  // and the checksum before
    expected.emplace(file.start(id) - 8, file.start(id) + file.block_bytes(id));
  const auto reads = source->reads();
  EXPECT_EQ(std::set(reads.begin(), reads.end()), expected);
  EXPECT_EQ(reads.size(), expected.size());
}

// A chunk of 64 samples along each axis is a brick, and is read alone.
TEST_F(ReadRegion, AnAlignedChunkIsOneBrick) {
  const Index3 large{129, 130, 131};
  const auto whole = blobs<std::uint8_t>(large, 1);
  write_nrrd(path("in.nrrd"), large, whole);
  encode_volume(path("in.nrrd"), {}, path("file.tag"), true, {.grid = GridOrigin::derived}, Resources(2));
  const auto source = std::make_shared<MemorySource>(file_content(path("file.tag")));
  const TagBricks file(source);
  file.start(0);  // reads the page of the index, once
  for (const Index3 chunk : {Index3{0, 0, 0}, {1, 0, 1}, {0, 1, 0}, {1, 1, 1}}) {
    source->reads();
    const Box box{64 * chunk, 64 * chunk + Index3{63, 63, 63}};
    std::vector<std::uint8_t> samples(64 * 64 * 64);
    read_region(file, {file.parameters().domain().points_of(box)},
                {reinterpret_cast<std::byte*>(samples.data()), {1, 64, 64 * 64}}, 2);
    const std::int64_t id = file.parameters().bricks().id(chunk);
    EXPECT_EQ(source->reads(),
              (std::vector{std::pair(file.start(id) - 8, file.start(id) + file.block_bytes(id))}));
    std::size_t i = 0;
    for (const auto [x, y, z] : points_of(box))
      ASSERT_EQ(samples[i++], whole[static_cast<std::size_t>(Box::of_size(large).offset({x, y, z}))]);
  }
}

TEST_F(ReadRegion, ADamagedBrickIsNeverHandedOut) {
  encode<std::int16_t>(false);
  const std::string good = file_content(path("file.tag"));
  const auto whole = read_samples<std::int16_t>(path("whole.nrrd"));
  const Region region{{{10, 10, 10}, {25, 25, 25}}};
  std::size_t refused = 0;
  for (std::size_t at = 0; at < good.size(); at += 37) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x10);
    try {
      const TagBricks file(std::make_shared<MemorySource>(bad));
      expect_region(file, whole, region);
    } catch (const BrokenInput&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 0U);
  // Every truncation is found when the file is opened.
  for (std::size_t size = 0; size < good.size(); size += 101)
    EXPECT_THROW(TagBricks(std::make_shared<MemorySource>(good.substr(0, size))), BrokenInput) << size;
}

TEST_F(ReadRegion, WhatFollowsAFileIsToldHoweverItIsRead) {
  encode<std::int16_t>(false);
  const std::string good = content("file.tag");
  for (const std::string& more : {std::string("x"), std::string(100, '\0'), good}) {
    const std::string name = file("more.tag", good + more);
    const auto open = [&] { TagBricks(std::make_shared<FileSource>(name)); };
    const auto read = [&] { TagReader(name).read_to_end(); };
    for (const std::string& message : {message_of<BrokenInput>(open), message_of<BrokenInput>(read)})
      EXPECT_TRUE(has(message, "extra bytes after"));
  }
}

TEST_F(ReadRegion, FewerThreadsFitIntoLessMemory) {
  encode<std::int16_t>(false);
  const CodingParameters parameters = TagBricks(source_).parameters();
  Resources resources(4);
  EXPECT_EQ(threads_for_reading(parameters, resources), 4);
  resources.memory = 1;
  try {
    threads_for_reading(parameters, resources);
    FAIL();
  } catch (const MemoryLimit& limit) {
    resources.memory = limit.needs().needed;
  }
  EXPECT_EQ(threads_for_reading(parameters, resources), 1);
  *resources.memory -= 1;
  EXPECT_THROW(threads_for_reading(parameters, resources), MemoryLimit);
}

// In pieces of one row of bricks, with the smallest possible memory.
TEST_F(ReadRegion, ARegionIsTheSameVolumeInAnyMemory) {
  encode<std::int16_t>(false);
  WantedRegion wanted;
  wanted.low = {5, {}, 3};
  wanted.high = {33, 41, {}};
  wanted.step = 2;
  decode_region(path("file.tag"), path("region.nrrd"), format_named("nrrd"), true, wanted, Resources(3));
  Resources little(3);
  little.memory = 1;
  try {
    decode_region(path("file.tag"), path("little.nrrd"), format_named("nrrd"), true, wanted, little);
    FAIL();
  } catch (const MemoryLimit& limit) {
    little.memory = limit.needs().needed;
  }
  decode_region(path("file.tag"), path("little.nrrd"), format_named("nrrd"), true, wanted, little);
  EXPECT_EQ(file_content(path("region.nrrd")), file_content(path("little.nrrd")));
  const auto whole = read_samples<std::int16_t>(path("whole.nrrd"));
  const auto samples = read_samples<std::int16_t>(path("region.nrrd"));
  const Region region = region_of(wanted, TagBricks(source_).parameters());
  const Index3 first{1, 1, 1};
  EXPECT_EQ(region.box.low - first, (Index3{6, 0, 4}));
  ASSERT_EQ(static_cast<std::int64_t>(samples.size()),
            region.shape().x * region.shape().y * region.shape().z);
  std::size_t i = 0;
  for_each_sample(region, [&](Index3, Index3 p) {
    ASSERT_EQ(samples[i++], whole[static_cast<std::size_t>(Box::of_size(dims).offset(p - first))]);
  });
}

TEST(WantedRegions, OutsideOfTheVolumeAreRefused) {
  CodingParameters p;
  p.dims = dims;
  const auto refused = [&](int axis, std::optional<std::int64_t> low, std::optional<std::int64_t> high,
                           std::int64_t step = 1) {
    WantedRegion wanted;
    wanted.low[static_cast<std::size_t>(axis)] = low;
    wanted.high[static_cast<std::size_t>(axis)] = high;
    wanted.step = step;
    EXPECT_THROW(region_of(wanted, p), UsageError);
  };
  refused(0, -1, 5);
  refused(0, 5, 5);
  refused(1, 6, 5);
  refused(1, 45, {});
  refused(2, {}, 30);
  refused(2, {}, 0);
  refused(0, {}, {}, 0);
  refused(0, {}, {}, 3);
  refused(0, {}, {}, 64);  // root cubes have an edge of 32
  refused(0, 1, 2, 2);     // not a multiple of 2
  WantedRegion all;
  EXPECT_TRUE(all.is_all());
  EXPECT_EQ(region_of(all, p).shape(), dims);
}

}  // namespace
}  // namespace tagrid
