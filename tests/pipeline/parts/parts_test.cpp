// Parts: their bricks, their files, and that the file made from them is the one that is written front to
// back.
#include <array>

#include "io/errors/errors.h"
#include "io/parts/part_file.h"
#include "io/parts/part_folder.h"
#include "io/parts/run_record.h"
#include "pipeline/parts/part_work.h"
#include "tests/support/awkward_volumes.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

std::int64_t samples_in(const BrickGrid& bricks, const BrickRows& rows) {
  const Box first = bricks.owned_box({0, rows.y_low, rows.z_low}),
            last = bricks.owned_box({bricks.bricks(0) - 1, rows.y_end - 1, rows.z_end - 1});
  return Box{first.low, last.high}.count();
}

const Index3 geometries[] = {{1, 1, 1},
                             {1, 1, 5000},
                             {5000, 1, 1},
                             {1, 5000, 1},
                             {65, 65, 65},
                             {64, 64, 64},
                             {500, 500, 500},
                             {512, 512, 1000},
                             {2048, 2048, 2048},
                             {16384, 16384, 3},
                             {20000, 20000, 12000},
                             {333, 7, 4001},
                             {std::int64_t{1} << 31, 100, 100}};

TEST(Parts, ArePartsOfEveryVolume) {
  for (const Index3& dims : geometries)
    for (const int cube : {8, 32, 256})
      for (const int edge : {1, 2}) {
        const BrickGrid bricks{{dims, cube}, edge};
        if (bricks.count() > 50'000'000) continue;
        std::int64_t next = 0;
        for (const BrickRows& rows : parts_of(bricks)) {
          ASSERT_EQ(rows.first_brick(bricks), next);
          ASSERT_GT(rows.count(bricks), 0);
          const bool whole_layers = rows.y_low == 0 && rows.y_end == bricks.bricks(1);
          ASSERT_TRUE(whole_layers || rows.z_end == rows.z_low + 1);
          next += rows.count(bricks);
        }
        ASSERT_EQ(next, bricks.count()) << dims.x << " " << dims.y << " " << dims.z << " " << cube;
      }
}

TEST(Parts, AreOfABoundedSizeAndNotManyMoreThanNeeded) {
  for (const Index3& dims : geometries) {
    const BrickGrid bricks{{dims, 32}, 2};
    const std::vector<BrickRows> parts = parts_of(bricks);
    const std::int64_t total = Box::of_size(dims).count();
    const std::int64_t row = dims.x * std::min<std::int64_t>(dims.y, 64) * std::min<std::int64_t>(dims.z, 64);
    for (const BrickRows& rows : parts) {
      const bool one_row = rows.y_end == rows.y_low + 1 && rows.z_end == rows.z_low + 1;
      // The first bricks along an axis own one sample more.
      EXPECT_TRUE(one_row || samples_in(bricks, rows) <= largest_part + largest_part / 20);
    }
    EXPECT_LE(static_cast<std::int64_t>(parts.size()),
              40 + 4 * (total / std::max(largest_part, row)) + (row > largest_part ? bricks.count() : 0))
        << dims.x << " " << dims.y << " " << dims.z;
  }
}

TEST(Parts, OfA500CubedVolumeAreOfHalfALayer) { EXPECT_EQ(parts_of({{{500, 500, 500}, 32}, 2}).size(), 16U); }

class PartFiles : public TemporaryFolder {
 protected:
  PartFiles() {
    parameters_.dims = {9, 9, 17};
    parameters_.cube_size = 8;
    parameters_.brick_edge = 1;
    parameters_.max_level = 9;
    id_ = {0x123456789, 3, 0, 2, sums_.size()};
    PartWriter writer(path("part"), id_, parameters_);
    for (std::int64_t i = 0; i < 2; ++i) {
      Statistics statistics;
      statistics.samples = 7 + static_cast<std::uint64_t>(i);
      statistics.low = 1.5;
      statistics.sum_squared_error = Uint128{5} << 70;
      statistics.active[4] = 11;
      writer.write_brick({i, {1, 2, 3}, {4, 5, static_cast<std::uint8_t>(i)}}, statistics);
    }
    writer.write_sums(sums_);
    writer.finish();
  }
  std::size_t read(const std::string& name, const PartId& id) const {
    PartReader reader(path(name), id, parameters_);
    std::vector<std::byte> block;
    for (std::size_t i = 0; i < reader.table().size(); ++i) reader.read_block(block);
    std::vector<std::byte> sums;
    reader.read_sums(
        5, [&](std::span<const std::byte> bytes) { sums.insert(sums.end(), bytes.begin(), bytes.end()); });
    EXPECT_EQ(sums, sums_) << name;
    return reader.table().size();
  }

  const std::vector<std::byte> sums_{12, std::byte{9}};
  CodingParameters parameters_;
  PartId id_;
};

TEST_F(PartFiles, ComeBackWithTheStatisticsOfEveryBrick) {
  EXPECT_EQ(read("part", id_), 2U);
  PartReader reader(path("part"), id_, parameters_);
  const Statistics& s = reader.table()[1].statistics;
  EXPECT_EQ(s.samples, 8U);
  EXPECT_EQ(s.low, 1.5);
  EXPECT_EQ(s.sum_squared_error, Uint128{5} << 70);
  EXPECT_EQ(s.active[4], 11U);
  EXPECT_EQ(reader.table()[0].value_bytes, 3U);
}

TEST_F(PartFiles, EveryFlippedBitEveryTruncationAndEveryOtherPartIsFound) {
  const std::string good = content("part");
  for (std::size_t size = 0; size < good.size(); ++size) {
    file("cut", good.substr(0, size));
    EXPECT_THROW(read("cut", id_), BrokenInput) << size;
  }
  file("long", good + "x");
  EXPECT_THROW(read("long", id_), BrokenInput);
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    std::string bad = good;
    bad[bit / 8] = static_cast<char>(bad[bit / 8] ^ (1 << bit % 8));
    file("bad", bad);
    EXPECT_THROW(read("bad", id_), BrokenInput) << bit;
  }
  for (PartId other :
       {PartId{1, 3, 0, 2, 12}, PartId{0x123456789, 4, 0, 2, 12}, PartId{0x123456789, 3, 1, 2, 12},
        PartId{0x123456789, 3, 0, 1, 12}, PartId{0x123456789, 3, 0, 2, 11},
        PartId{0x123456789, 3, 0, std::int64_t{1} << 60, 12}})
    EXPECT_THROW(read("part", other), BrokenInput);
}

TEST(RunRecords, ComeBackAndEveryFlippedBitAndEveryTruncationIsFound) {
  RunRecord record;
  record.program = "tagrid 1";
  record.settings = {{"max-error", "2"}, {"cube", "32"}};
  record.inputs = {{"in.nrrd", 12345, 77, 1, 2, -3, 4, 99}};
  record.header = {std::byte{1}, std::byte{2}};
  record.error_rule = "psnr 55";
  record.reason_of_bound = "maximum error set to 2, to reach 55 dB";
  const std::vector<std::byte> good = serialize_record(record);
  RunRecord back;
  ASSERT_TRUE(parse_record(good, back).ok());
  EXPECT_EQ(difference_of(record, back), Sentence());
  EXPECT_EQ(back.inputs[0].changed, -3);
  EXPECT_EQ(back.error_rule, record.error_rule);
  EXPECT_EQ(back.reason_of_bound, record.reason_of_bound);
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_FALSE(parse_record(std::span(good).first(size), back).ok()) << size;
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    std::vector<std::byte> bad = good;
    bad[bit / 8] ^= std::byte{1} << bit % 8;
    EXPECT_FALSE(parse_record(bad, back).ok()) << bit;
  }
}

TEST(RunRecords, NameTheSettingAndTheInputThatChanged) {
  RunRecord was;
  was.settings = {{"max-error", "2"}, {"cube", "32"}};
  was.inputs = {{"in.nrrd", 12345, 77, 1, 2, 3, 4, 99}};
  RunRecord now = was;
  now.settings[0].second = "3";
  EXPECT_EQ(difference_of(was, now).text, "max-error was 2, now 3");
  EXPECT_EQ(difference_of(was, now).with_options, "--max-error was 2, now 3");
  now = was;
  now.inputs[0].size = 7;
  EXPECT_EQ(difference_of(was, now).text, "the input in.nrrd has changed since: it had 12345 bytes, now 7");
  now = was;
  now.inputs[0].modified = 1'000'000'000;
  EXPECT_TRUE(has(difference_of(was, now).text, "has changed since: modified 2001-09-"));
  for (auto member : {&FileIdentity::inode, &FileIdentity::ends_checksum}) {
    now = was;
    ++(now.inputs[0].*member);
    EXPECT_NE(difference_of(was, now), Sentence());
  }
  now = was;
  ++now.inputs[0].changed_ns;
  EXPECT_NE(difference_of(was, now), Sentence());
}

class InParts : public TemporaryFolder {
 protected:
  // Awkward sizes with enough rows of bricks for parts of rows and of layers.
  template <class T>
  void expect_same_file(Index3 dims, const EncodeOptions& options, Awkward kind) {
    write_nrrd<T>(path("in.nrrd"), dims, awkward_volume<T>(kind, dims, 5));
    encode_volume(path("in.nrrd"), {}, path("streamed.tag"), true, options, Resources(2));
    Ranks one;
    for (const bool resume : {false, true}) {
      committed(encode_in_parts(one, {.input = path("in.nrrd"),
                                      .output = path("parts.tag"),
                                      .overwrite = true,
                                      .options = options,
                                      .resources = Resources(2),
                                      .resume = resume,
                                      .program = "test"}));
      EXPECT_TRUE(content("parts.tag") == content("streamed.tag")) << name_of(kind);
    }
    EXPECT_EQ(names(), (std::vector<std::string>{"in.nrrd", "parts.tag", "streamed.tag"}));
  }
};

template <class T>
class EveryTypeInParts : public InParts {};
TYPED_TEST_SUITE(EveryTypeInParts, AllTypes);

TYPED_TEST(EveryTypeInParts, TheFileIsThatWithoutParts) {
  EncodeOptions options{.cube_size = 8, .brick_edge = 1};
  for (const Awkward kind : {Awkward::smooth, Awkward::sparse, Awkward::not_finite_blobs})
    for (const bool grid : {false, true})
      for (const Effort effort : {Effort::normal, Effort::fast, Effort::best}) {
        if (effort != Effort::normal && (grid || sizeof(TypeParam) > 2)) continue;
        options.grid_only = grid;
        options.effort = effort;
        options.max_error = grid ? std::optional<double>() : kind == Awkward::smooth ? 3 : 0;
        this->template expect_same_file<TypeParam>({19, 27, 23}, options, kind);
        if (this->HasFailure()) return;
      }
}

TEST_F(InParts, EveryGeometryGivesTheFileWithoutParts) {
  EncodeOptions options{.max_error = 2, .mesh_error = 5, .cube_size = 8, .brick_edge = 1};
  for (const Index3& dims : {Index3{1, 1, 1}, Index3{9, 1, 200}, Index3{200, 9, 1}, Index3{3, 150, 12},
                             Index3{10, 40, 40}, Index3{10, 17, 90}})
    expect_same_file<std::int16_t>(dims, options, Awkward::smooth);
}

TEST_F(InParts, ARunThatGoesOnSearchesForItsLargestErrorOnlyIfItMust) {
  write_nrrd<std::int16_t>(path("in.nrrd"), {40, 50, 60},
                           awkward_volume<std::int16_t>(Awkward::smooth, {40, 50, 60}, 5));
  struct Interrupted {};
  Ranks one;
  int tries = 0;
  const auto run = [&](double psnr, bool interrupted) {
    tries = 0;
    EncodeRun order{.input = path("in.nrrd"), .output = path("out.tag"), .resources = Resources(2)};
    order.options.error_rule = ErrorRule{ErrorRule::Kind::psnr, psnr};
    order.options.cube_size = 8;
    order.options.brick_edge = 1;
    if (interrupted) order.progress = [](std::uint64_t, std::uint64_t) { throw Interrupted(); };
    order.searching = [&](std::uint64_t done, std::uint64_t total) { tries += done == total; };
    order.resume = true;
    order.program = "test";
    return committed(encode_in_parts(one, order));
  };
  EXPECT_THROW(run(45, true), Interrupted);
  EXPECT_GE(tries, 2);
  const EncodeResult result = run(45, false);
  EXPECT_EQ(tries, 0);
  EXPECT_TRUE(has(result.reason_of_bound, ", to reach 45 dB"));
  const std::string resumed = content("out.tag");
  std::filesystem::remove(path("out.tag"));
  run(45, false);
  EXPECT_GE(tries, 2);
  EXPECT_TRUE(content("out.tag") == resumed);

  // Another rule has its own search, and is refused if it finds another bound.
  std::filesystem::remove(path("out.tag"));
  EXPECT_THROW(run(45, true), Interrupted);
  EXPECT_THROW(run(25, false), UsageError);
  EXPECT_GE(tries, 2);
}

}  // namespace
}  // namespace tagrid
