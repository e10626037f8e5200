// Rows of bricks, decoded separately and written to their position, make the volume.
#include <atomic>
#include <cstring>

#include "io/errors/errors.h"
#include "io/tag/bricks.h"
#include "pipeline/decode/decode_run.h"
#include "pipeline/decode/graph.h"
#include "tests/support/rows_of_volume.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/tag_in_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

constexpr Index3 dims{50, 41, 45};

class DecodedRowsTest : public TemporaryFolder {
 protected:
  void encode(bool grid_only) {
    samples_ = blobs<std::int16_t>(dims, 1);
    write_nrrd(path("a.nrrd"), dims, samples_);
    EncodeOptions options{.grid_only = grid_only, .cube_size = 8, .brick_edge = 2};
    encode_volume(path("a.nrrd"), {}, tag_, true, options, Resources(2));
    decode_volume(tag_, path("whole.raw"), format_named("raw"), true, Resources(2));
    whole_ = file_content(path("whole.raw"));
  }

  /// All stretches of bricks that can be decoded together.
  static std::vector<BrickRows> stretches(const BrickGrid& bricks) {
    std::vector<BrickRows> all;
    for (std::int64_t z = 0; z < bricks.bricks(2); ++z) {
      all.push_back({0, bricks.bricks(1), z, bricks.bricks(2)});
      for (std::int64_t y = 0; y < bricks.bricks(1); ++y)
        for (std::int64_t end = y + 1; end <= bricks.bricks(1); ++end) all.push_back({y, end, z, z + 1});
    }
    return all;
  }

  static TagBricks opened(const std::string& path) { return TagBricks(std::make_shared<FileSource>(path)); }

  void decode(const TagBricks& file, const BrickRows& rows, const DecodeBudget& budget,
              const std::function<void(std::int64_t, std::span<const std::byte>)>& take) const {
    BricksInOrder bricks(file, rows.first_brick(file.parameters().bricks()));
    RowsTo sink([&](const DecodedRows& decoded) {
      std::size_t bytes = 0;
      decoded.for_each_part([&](std::int64_t first, std::span<const std::byte> part) {
        bytes += part.size();
        take(first, part);
      });
      EXPECT_EQ(bytes, decoded.bytes());
    });
    Watch unwatched;
    tagrid::decode({file.parameters(), budget, rows}, bricks, sink, unwatched);
  }

  const std::string tag_ = path("a.tag");
  std::vector<std::int16_t> samples_;
  std::string whole_;
};

TEST_F(DecodedRowsTest, OfAnyStretchAreThoseOfTheWhole) {
  for (const bool grid_only : {false, true}) {
    encode(grid_only);
    const TagBricks file = opened(tag_);
    const BrickGrid bricks = file.parameters().bricks();
    for (const BrickRows& rows : stretches(bricks))
      for (const std::int64_t together : {1, 2, 5}) {
        std::int64_t count = 0;
        decode(file, rows, {2, 3, together}, [&](std::int64_t first, std::span<const std::byte> part) {
          count += static_cast<std::int64_t>(part.size()) / 2;
          const std::size_t place = static_cast<std::size_t>(first) * 2;
          ASSERT_LE(place + part.size(), whole_.size());
          EXPECT_EQ(std::memcmp(whole_.data() + place, part.data(), part.size()), 0);
        });
        const Box low = bricks.owned_box({0, rows.y_low, rows.z_low}),
                  high = bricks.owned_box({bricks.bricks(0) - 1, rows.y_end - 1, rows.z_end - 1});
        EXPECT_EQ(count, (Box{low.low, high.high}.count()));
      }
  }
}

TEST_F(DecodedRowsTest, WrittenInAnyOrderMakeTheSameFile) {
  encode(false);
  const TagBricks file = opened(tag_);
  const BrickGrid bricks = file.parameters().bricks();
  std::vector<BrickRows> rows;
  for (std::int64_t z = 0; z < bricks.bricks(2); ++z)
    for (std::int64_t y = 0; y < bricks.bricks(1); ++y) rows.push_back({y, y + 1, z, z + 1});
  std::mt19937 random(1);
  for (const std::string name : {"b.nrrd", "b.nhdr", "b.raw"}) {
    std::shuffle(rows.begin(), rows.end(), random);
    VolumeInfo info{dims, SampleType::int16};
    const auto writer =
        create_volume(format_from_name(name), path(name), info, {.files = {.overwrite = true}});
    ASSERT_TRUE(writer->any_order());
    for (const BrickRows& row : rows)
      decode(file, row, {1, 1, 1}, [&](std::int64_t first, std::span<const std::byte> part) {
        writer->write_samples(first, part);
      });
    const std::uint64_t bytes = writer->bytes_written();
    writer->commit();
    if (name == "b.raw") {
      EXPECT_EQ(content("b.raw"), whole_);
      EXPECT_EQ(bytes, whole_.size());
    } else {
      EXPECT_EQ(read_samples<std::int16_t>(path(name)), samples_) << name;
    }
  }
}

TEST_F(DecodedRowsTest, ThreadsHandOutEachSampleOnceAndAFailureOfOneEndsIt) {
  const Index3 large{301, 290, 40};  // slices that are worth a task of their own
  const auto samples = blobs<std::int16_t>(large, 2);
  write_nrrd(path("a.nrrd"), large, samples);
  encode_volume(path("a.nrrd"), {}, tag_, true,
                {.grid = GridOrigin::derived, .cube_size = 16, .brick_edge = 2}, Resources(2));
  const TagBricks file = opened(tag_);
  const auto decode_on = [&](int threads, const auto& take) {
    BricksInOrder bricks(file);
    RowsTo sink([&](const DecodedRows& decoded) { decoded.for_each_part_at_once(take); });
    Watch unwatched;
    tagrid::decode({file.parameters(), {threads, 8, 3}, BrickRows::all(file.parameters().bricks())}, bricks,
                   sink, unwatched);
  };
  for (const int threads : sanitized ? std::vector{5} : std::vector{1, 2, 5}) {
    std::vector<std::int16_t> found(samples.size());
    std::atomic<std::size_t> bytes = 0;
    decode_on(threads, [&](std::int64_t first, std::span<const std::byte> part) {
      bytes += part.size();
      std::memcpy(found.data() + first, part.data(), part.size());
    });
    EXPECT_EQ(bytes, 2 * samples.size());
    EXPECT_TRUE(found == samples);
    EXPECT_THROW(decode_on(threads,
                           [&](std::int64_t first, std::span<const std::byte>) {
                             if (first > large.x * large.y * 20) throw WorldError("full");
                           }),
                 WorldError);
  }
}

TEST_F(DecodedRowsTest, DamageBeforeABrickIsNoneOfIt) {
  encode(false);
  const TagBricks whole = opened(tag_);
  const BrickGrid bricks = whole.parameters().bricks();
  // In the middle of the first brick, which begins right after the header.
  const std::size_t place = whole.sizes().header + 24 + whole.entry(0).activity_bytes / 2;
  file("damaged.tag", flipped(content("a.tag"), place));
  const TagBricks damaged = opened(path("damaged.tag"));
  const auto nothing = [](std::int64_t, std::span<const std::byte>) {};
  EXPECT_NO_THROW(decode(damaged, {1, 2, 0, 1}, {1, 1, 1}, nothing));
  EXPECT_THROW(decode(damaged, {0, 1, 0, 1}, {1, 1, 1}, nothing), BrokenInput);
  EXPECT_NO_THROW(decode(damaged, {0, bricks.bricks(1), 1, bricks.bricks(2)}, {2, 4, 2}, nothing));
}

// Rows of bricks make the same volume whether they are written to their position or through a temporary file.

class RowOutputTest : public TemporaryFolder {
 protected:
  RowOutputTest() : samples_(blobs<std::int16_t>(dims_, 1)) {
    parameters_.dims = dims_;
    parameters_.type = SampleType::int16;
    parameters_.cube_size = 4;
    parameters_.brick_edge = 2;
  }

  /// The samples of a file, written `together` rows at a time.
  std::string written(std::int64_t together, const std::optional<std::string>& spool) const {
    const auto writer = create_volume(format_named("raw"), path("out.raw"), {dims_, SampleType::int16},
                                      {.files = {.overwrite = true}});
    RowOutput output(*writer, spool, "out.raw");
    for_each_rows<std::int16_t>(parameters_, BrickRows::all(parameters_.bricks()), together, samples_,
                                [&](const DecodedRows& rows) { output.write(rows); });
    writer->commit();
    return content("out.raw");
  }

  static constexpr Index3 dims_{21, 30, 19};
  std::vector<std::int16_t> samples_;
  CodingParameters parameters_;
};

TEST_F(RowOutputTest, AnyNumberOfRowsAtATimeMakesTheVolumeAtItsPlaceAndThroughATemporary) {
  const std::string expected(reinterpret_cast<const char*>(samples_.data()),
                             samples_.size() * sizeof(std::int16_t));
  for (const std::int64_t together : {1, 2, 3, 100}) {
    EXPECT_TRUE(written(together, std::nullopt) == expected) << together;
    EXPECT_TRUE(written(together, folder_.string()) == expected) << together;
  }
  EXPECT_EQ(names(), std::vector<std::string>{"out.raw"}) << "the temporary has no name";
}

}  // namespace
}  // namespace tagrid
