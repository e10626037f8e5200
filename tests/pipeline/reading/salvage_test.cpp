// What is whole of a damaged file comes back, and nothing else.
#include <gtest/gtest.h>

#include <filesystem>

#include "io/errors/errors.h"
#include "io/tag/bricks.h"
#include "io/tag/whole_bricks.h"
#include "pipeline/run/run.h"
#include "tests/support/points.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/tag_in_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

constexpr Index3 salvaged_dims{11, 6, 10};
constexpr std::uint8_t fill_value = 201;  // no voxel of the volumes here has this value

class SalvageTest : public TemporaryFolder {
 protected:
  /// A file of 2 x 1 x 2 bricks; `whole_` is what it decodes to.
  std::string make_file(bool grid = false, unsigned seed = 1) {
    std::vector<std::uint8_t> voxels = blobs<std::uint8_t>(salvaged_dims, seed);
    for (auto& voxel : voxels) voxel = static_cast<std::uint8_t>(voxel / 2);
    return encoded(voxels, grid);
  }
  std::string encoded(const std::vector<std::uint8_t>& voxels, bool grid = false) {
    write_nrrd(path("in.nrrd"), salvaged_dims, voxels);
    EncodeOptions options{.grid_only = grid, .max_error = 4, .cube_size = 4, .brick_edge = 2};
    encode_volume(path("in.nrrd"), {}, path("a.tag"), true, options, Resources(1));
    decode_volume(path("a.tag"), path("whole.raw"), format_named("raw"), true, Resources(1));
    whole_ = content("whole.raw");
    return content("a.tag");
  }

  Salvage salvage(const std::string& bytes, WantedRegion region = {}) {
    file("b.tag", bytes);
    Ranks alone;
    FinishedDecode decoded = decode_volume(alone, {.input = path("b.tag"),
                                                   .output = path("b.raw"),
                                                   .format = format_named("raw"),
                                                   .overwrite = true,
                                                   .region = region,
                                                   .fill = fill_value,
                                                   .resources = Resources(1)});
    decoded.commit();
    return *decoded.result.salvage;
  }

  /// Every voxel of a lost brick has the fill, and every other one is that of the whole file.
  Salvage expect_right(const std::string& bytes, const std::string& what) {
    const Salvage found = salvage(bytes);
    const BrickGrid bricks{{salvaged_dims, 4, 1}, 2};
    std::string expected = whole_;
    for (const BrickRun& run : found.lost)
      for (const Box& box : boxes_of(run, bricks))
        for (const auto [x, y, z] : points_of(box))
          expected[static_cast<std::size_t>(Box::of_size(salvaged_dims).offset({x, y, z}))] =
              static_cast<char>(fill_value);
    EXPECT_TRUE(content("b.raw") == expected) << what;
    return found;
  }

  std::string whole_;
};

std::int64_t count(const std::vector<BrickRun>& runs) {
  std::int64_t bricks = 0;
  for (const BrickRun& run : runs) bricks += run.last - run.first + 1;
  return bricks;
}

TEST_F(SalvageTest, AWholeFileHasNoDamage) {
  for (const bool grid : {false, true}) {
    const Salvage found = salvage(make_file(grid));
    EXPECT_FALSE(found.is_damaged());
    EXPECT_TRUE(found.has_index);
    EXPECT_EQ(content("b.raw"), whole_);
  }
}

TEST_F(SalvageTest, AFlippedBitCostsAtMostOneBrick) {
  for (const bool grid : {false, true}) {
    const std::string whole = make_file(grid);
    const auto bricks = frames(whole);
    const std::size_t end = bricks.back().first + bricks.back().second;
    ASSERT_EQ(bricks.size(), 4u);
    for (std::size_t bit = 8 * bricks.front().first; bit < 8 * whole.size(); bit += 7 * damage_stride) {
      const Salvage found = expect_right(flipped(whole, bit / 8, 1 << bit % 8), "bit " + std::to_string(bit));
      EXPECT_LE(count(found.lost), bit / 8 < end ? 1 : 0) << bit;
      EXPECT_TRUE(found.is_damaged()) << bit;
    }
  }
}

TEST_F(SalvageTest, ADamagedChecksumCostsNothing) {
  const std::string whole = make_file();
  for (const auto& [start, size] : frames(whole)) {
    const Salvage found = salvage(flipped(whole, start + size - 3, 8));
    EXPECT_TRUE(found.lost.empty()) << start;
    EXPECT_TRUE(found.is_damaged_elsewhere);
    EXPECT_EQ(content("b.raw"), whole_);
  }
}

TEST_F(SalvageTest, ATruncatedFileHasTheBricksBeforeItsEnd) {
  const std::string whole = make_file();
  const auto bricks = frames(whole);
  const std::size_t first_end = bricks.front().first + bricks.front().second;
  for (std::size_t size = bricks.front().first; size < first_end; size += 3)
    EXPECT_THROW(salvage(whole.substr(0, size)), BrokenInput) << size;
  for (std::size_t size = first_end; size < whole.size(); size += 3) {
    std::int64_t before = 0;
    for (const auto& [start, length] : bricks) before += start + length <= size;
    const Salvage found = expect_right(whole.substr(0, size), std::to_string(size));
    EXPECT_EQ(count(found.lost), 4 - before) << size;
    EXPECT_FALSE(found.has_index);
  }
}

TEST_F(SalvageTest, WithoutAHeaderNothingIsGiven) {
  const std::string whole = make_file();
  const std::size_t header = frames(whole).front().first;
  for (std::size_t byte = 0; byte < header; ++byte) {
    EXPECT_THROW(salvage(flipped(whole, byte)), BrokenInput) << byte;
    EXPECT_THROW(salvage(whole.substr(0, byte)), BrokenInput) << byte;
  }
  EXPECT_FALSE(std::filesystem::exists(path("b.raw")));
}

TEST_F(SalvageTest, BricksOfAnotherFileOrPlaceAreNotGiven) {
  const std::string b = make_file(false, 2), a = make_file(false, 1);
  expect_right(with_bricks(a, 1, 2, frame_of(a, 2) + frame_of(a, 1)), "swapped");
  expect_right(with_bricks(a, 1, 2, frame_of(a, 1) + frame_of(a, 1)), "repeated");
  expect_right(with_bricks(a, 1, 1, ""), "left out");
  expect_right(with_bricks(a, 1, 1, frame_of(b, 1)), "of another file with the same header");
  expect_right(with_bricks(a, 1, 2, frame_of(b, 1) + frame_of(b, 2)), "two of another file");
}

TEST_F(SalvageTest, ABrickOfAnotherFileThatFitsBetweenTwoLostOnesIsNotGiven) {
  const std::vector<std::uint8_t> high(static_cast<std::size_t>(Box::of_size(salvaged_dims).count()), 90);
  const std::vector<std::uint8_t> low(high.size(), 10);
  const std::string b = encoded(high), a = encoded(low);
  const auto bricks = frames(a);
  ASSERT_EQ(bricks, frames(b)) << "equal sizes, so that the index of one fits the other";
  const std::size_t begin = bricks[1].first, end = bricks[3].first;
  const Salvage found =
      expect_right(a.substr(0, begin) + b.substr(begin, end - begin) + a.substr(end), "two bricks of b");
  EXPECT_TRUE(found.has_index);
  EXPECT_EQ(found.lost, (std::vector<BrickRun>{{1, 3}}));
}

TEST_F(SalvageTest, ManyDamagesAtOnceGiveOnlyWhatIsRight) {
  const std::string whole = make_file();
  std::mt19937 random(5);
  for (int i = 0; i < 200; ++i) {
    std::string damaged = whole;
    for (unsigned n = 1 + random() % 6; n > 0; --n) {
      const std::size_t at = random() % damaged.size(), length = 1 + random() % 40;
      if (random() % 3 == 0)
        damaged.erase(at, length);
      else
        for (std::size_t j = at; j < std::min(at + length, damaged.size()); ++j)
          damaged[j] = static_cast<char>(random());
    }
    try {
      expect_right(damaged, std::to_string(i));
    } catch (const BrokenInput&) {  // the header
    }
  }
}

TEST_F(SalvageTest, ARegionAndAStepAreSalvagedToo) {
  const std::string whole = make_file();
  const std::string damaged = flipped(whole, frames(whole)[1].first + 9);
  WantedRegion region;
  region.low[2] = 4;
  region.step = 2;
  const Salvage found = salvage(damaged, region);
  EXPECT_EQ(found.lost, (std::vector<BrickRun>{{1, 1}}));
  const std::string samples = content("b.raw");
  ASSERT_EQ(samples.size(), 6u * 3 * 3);
  const BrickGrid grid{{salvaged_dims, 4, 1}, 2};
  const Box lost = grid.domain.samples_at(grid.owned_box({1, 0, 0}));
  std::size_t i = 0;
  for (std::int64_t z = 4; z < 10; z += 2)
    for (std::int64_t y = 0; y < 6; y += 2)
      for (std::int64_t x = 0; x < 11; x += 2, ++i)
        EXPECT_EQ(samples[i],
                  lost.contains(Index3{x, y, z})
                      ? static_cast<char>(fill_value)
                      : whole_[static_cast<std::size_t>(Box::of_size(salvaged_dims).offset({x, y, z}))]);
}

TEST_F(SalvageTest, DamageThatARegionDoesNotMeetIsNotSaidToBeInIt) {
  const std::string whole = make_file();
  WantedRegion region;
  region.high[2] = 5;
  EXPECT_FALSE(salvage(flipped(whole, frames(whole)[3].first + 9), region).is_damaged());
}

TEST(BrickRuns, ARunIsAtMostFiveBoxesThatHoldItsBricksAndNoOthers) {
  const BrickGrid bricks{{{50, 40, 30}, 4, 1}, 2};
  for (std::int64_t first = 0; first < bricks.count(); ++first)
    for (std::int64_t last = first; last < bricks.count(); last += 1 + (last - first) / 7) {
      const std::vector<Box> boxes = boxes_of({first, last}, bricks);
      ASSERT_LE(boxes.size(), 5u);
      std::int64_t in_boxes = 0, in_bricks = 0;
      for (const Box& box : boxes) in_boxes += box.count();
      for (std::int64_t id = first; id <= last; ++id) {
        const Box owned = bricks.domain.samples_at(bricks.owned_box(bricks.position(id)));
        in_bricks += owned.count();
        ASSERT_TRUE(std::ranges::any_of(boxes, [&](const Box& box) { return box.contains(owned); }))
            << first << " " << last;
      }
      ASSERT_EQ(in_boxes, in_bricks);
    }
}

}  // namespace
}  // namespace tagrid
