// The index is read in parts: what a file costs to open, which pages are read, and what a damaged page costs.
#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <iostream>

#include "io/errors/errors.h"
#include "io/metadata/text.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "io/tag/whole_bricks.h"
#include "pipeline/reading/read_region.h"
#include "tests/support/counted_heap.h"
#include "tests/support/forged_index.h"
#include "tests/support/points.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/tag_in_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

using Reads = std::vector<std::pair<std::uint64_t, std::uint64_t>>;

std::uint64_t bytes_of(const Reads& reads) {
  std::uint64_t bytes = 0;
  for (const auto& [first, end] : reads) bytes += end - first;
  return bytes;
}

// 24,389,000 bricks of 64 samples along an edge: 13 TB of samples.
TagHeader header_of_a_large_volume() {
  const std::int64_t edge = 290 * 64 + 1;
  return {{.dims = {edge, edge, edge},
           .type = SampleType::int16,
           .grid = GridOrigin::derived,
           .cube_size = 32,
           .brick_edge = 2,
           .max_level = max_level(32),
           .field_scale = 1,
           .max_error = 0},
          parse_metadata("spacings: 1 1 1\n")};
}
const std::vector<std::uint8_t> constant_five = {0, 5, 0};

TEST(IndexPages, AFileOfAnySizeIsOpenedByTheLast256KiB) {
  const std::int64_t brick = 4096 * 2500 + 77;
  const auto source = std::make_shared<ForgedTag>(header_of_a_large_volume(), constant_five, brick);
  source->reads();
  const HeapPeak heap;
  const std::clock_t start = std::clock();
  const TagBricks file(source);
  std::cout << "opened in " << static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC << " s, with "
            << heap.bytes() << " bytes of heap\n";
  EXPECT_LT(heap.bytes(), sanitized ? 40'000'000U : 5'000'000U);
  const Reads opening = source->reads();
  EXPECT_EQ(opening.size(), 2U) << "the header and the end";
  EXPECT_LE(bytes_of(opening), 4096U + largest_end);
  EXPECT_EQ(file.count(), 24'389'000);
  EXPECT_EQ(file.index().pages.size(), 5955U);
  EXPECT_EQ(file.sizes().values, 3 * 24'389'000ULL);
  EXPECT_EQ(source->reads().size(), 0U) << "counts and sizes need no page";

  // One brick: the sizes of its page, and its block.
  const Index3 position = file.parameters().bricks().position(brick);
  const Box owned = file.parameters().bricks().owned_box(position);
  std::vector<std::int16_t> samples(static_cast<std::size_t>(owned.count()));
  const Index3 n = owned.size();
  const auto read = [&] {
    read_region(file, {owned, {1, 1, 1}},
                {reinterpret_cast<std::byte*>(samples.data()), {2, 2 * n.x, 2 * n.x * n.y}}, 1);
  };
  read();
  EXPECT_TRUE(std::ranges::all_of(samples, [](std::int16_t v) { return v == 5; }));
  const std::uint64_t page = source->end_of_bricks(2500), at = source->start_of_whole_brick();
  const Reads expected = {{page - 8, page + source->facts_of(2500).sizes_bytes},
                          {at - 8, at + source->bytes_of_whole_brick()}};
  EXPECT_EQ(source->reads(), expected);
  // The page is kept.
  read();
  EXPECT_EQ(source->reads(), Reads{expected[1]});
  // Its statistics are read when they are wanted.
  EXPECT_EQ(file.entry(brick).high, 7);
  EXPECT_EQ(source->reads().size(), 1U);
  // A walk over all pages keeps a few.
  const HeapPeak walk;
  for (std::int64_t b = 0; b < file.count(); b += 4096) ASSERT_EQ(file.block_bytes(b), 19U);
  EXPECT_LT(walk.bytes(), sanitized ? 40'000'000U : 8'000'000U);
}

TEST(IndexPages, ADamagedPageIsOneOfItsBricksOnly) {
  const std::int64_t brick = 4096 * 3 + 5;
  ForgedTag forged(header_of_a_large_volume(), constant_five, brick);
  const std::uint64_t first = forged.end_of_bricks(3), end = first + forged.facts_of(3).sizes_bytes;
  for (std::uint64_t at = first; at < end; ++at) {
    const auto source = std::make_shared<ForgedTag>(header_of_a_large_volume(), constant_five, brick);
    source->damage(at);
    const TagBricks file(source);
    const std::string what = message_of<BrokenInput>([&] { file.read(brick); });
    EXPECT_TRUE(what.starts_with("forged: page 3 of the index (bricks 12288 to 16383), before byte "))
        << what;
    EXPECT_EQ(file.block_bytes(2 * 4096), 19U);
    EXPECT_EQ(file.block_bytes(4 * 4096), 19U);
    EXPECT_EQ(file.entry(4 * 4096).low, -1);
  }
  // Statistics that are damaged keep no samples back.
  for (std::uint64_t at = end; at < end + forged.facts_of(3).statistics_bytes; ++at) {
    const auto source = std::make_shared<ForgedTag>(header_of_a_large_volume(), constant_five, brick);
    source->damage(at);
    const TagBricks file(source);
    EXPECT_NO_THROW(file.read(brick));
    EXPECT_THROW(file.entry(brick), BrokenInput);
  }
}

TEST(IndexPages, TheDirectoryOfAnyFileIsSmall) {
  const IndexForm largest = {max_level(256) + 1, true, true};
  for (const std::int64_t bricks :
       {std::int64_t{1}, std::int64_t{4096}, std::int64_t{4097}, std::int64_t{25'165'824},
        std::int64_t{25'165'825}, std::int64_t{2'000'000'000},
        PageLayout::most_pages * PageLayout::most_bricks}) {
    const PageLayout layout(bricks);
    EXPECT_TRUE(layout.is_possible());
    EXPECT_LE(layout.pages(), PageLayout::most_pages);
    EXPECT_LE(least_directory_size(layout.pages(), largest), std::uint64_t{200'000});
    EXPECT_EQ(layout.first(layout.pages() - 1) + layout.bricks_in(layout.pages() - 1), bricks);
    EXPECT_EQ(layout.page_of(bricks - 1), layout.pages() - 1);
  }
  EXPECT_EQ(PageLayout(25'165'824).per_page(), 4096);
  EXPECT_EQ(PageLayout(25'165'825).per_page(), 8192);
  EXPECT_FALSE(PageLayout(PageLayout::most_pages * PageLayout::most_bricks + 1).is_possible());
}

TEST(IndexPages, SectionsThatAreNotKnown) {
  const IndexForm form;
  TagIndex index;
  index.pages.resize(3);
  const std::vector<std::byte> good = serialize_directory(index, form);
  const auto with = [&](std::uint32_t kind, std::uint64_t claimed, std::size_t present) {
    FieldWriter section;
    section.put(kind);
    section.put(claimed);
    std::vector<std::byte> all = good;
    all.insert(all.end(), section.bytes().begin(), section.bytes().end());
    all.resize(all.size() + present);
    return all;
  };
  const auto parsed = [&](const std::vector<std::byte>& bytes) {
    return parse_directory(bytes, 3, form, index);
  };
  EXPECT_TRUE(parsed(good).ok());
  EXPECT_TRUE(index.unknown_sections.empty());
  EXPECT_TRUE(parsed(with(1 << 16, 5, 5)).ok()) << "skipped by its length";
  EXPECT_EQ(index.unknown_sections, std::vector<std::uint32_t>{1 << 16});
  const Status needed = parsed(with(4, 5, 5));
  EXPECT_FALSE(needed.ok());
  EXPECT_TRUE(needed.is_newer());
  EXPECT_NE(std::string(needed.what()).find("a section of kind 4"), std::string::npos);
  EXPECT_FALSE(parsed(with(1 << 16, 5, 4)).ok()) << "cut off";
  EXPECT_FALSE(parsed(with(1 << 16, ~std::uint64_t{0}, 4)).ok());
  EXPECT_FALSE(parsed(with(2, 0, 0)).ok()) << "twice";
  EXPECT_FALSE(parsed(with(members_section, 5, 5)).ok()) << "not a table of members";
  EXPECT_FALSE(parsed(with(members_section, 0, 0)).ok()) << "a table without members";
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_FALSE(parsed({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)}).ok()) << size;
}

// 16 x 16 x 20 bricks: more than one page.
class TwoPages : public TemporaryFolder {
 protected:
  TwoPages() {
    write_nrrd(path("in.nrrd"), dims_, samples_);
    encode_volume(path("in.nrrd"), {}, path("a.tag"), true, options_, Resources(2));
    tag_ = file_content(path("a.tag"));
  }
  std::string region(const std::string& tag, const Box& box) const {
    const TagBricks file(std::make_shared<MemorySource>(tag));
    std::string samples(static_cast<std::size_t>(box.count()), '\0');
    const Index3 n = box.size();
    read_region(file, {file.parameters().domain().points_of(box), {1, 1, 1}},
                {reinterpret_cast<std::byte*>(samples.data()), {1, n.x, n.x * n.y}}, 1);
    return samples;
  }
  std::string original(const Box& box) const {
    std::string samples;
    for (const Index3 p : points_of(box))
      samples += static_cast<char>(samples_[static_cast<std::size_t>(Box::of_size(dims_).offset(p))]);
    return samples;
  }

  const Index3 dims_{64, 64, 80};
  const std::vector<std::uint8_t> samples_ = blobs<std::uint8_t>(dims_, 3);
  const EncodeOptions options_{.max_error = 0, .cube_size = 4, .brick_edge = 1};
  std::string tag_;
};

TEST_F(TwoPages, AreReadFrontToBackAndByTheIndex) {
  const TagBricks file(std::make_shared<MemorySource>(tag_));
  ASSERT_EQ(file.count(), 5120);
  ASSERT_EQ(file.index().pages.size(), 2U);
  EXPECT_EQ(region(tag_, Box::of_size(dims_)), original(Box::of_size(dims_)));
  decode_volume(path("a.tag"), path("b.raw"), format_named("raw"), true, Resources(2));
  EXPECT_EQ(content("b.raw"), original(Box::of_size(dims_)));
  EXPECT_NO_THROW(verify_file(path("a.tag"), path("in.nrrd"), {}, Resources(2)));
  // Entries are the same, whichever way they come.
  TagReader reader(path("a.tag"));
  std::vector<IndexEntry> entries;
  reader.look_at_pages(
      [&](std::span<const IndexEntry> page) { entries.insert(entries.end(), page.begin(), page.end()); });
  reader.read_to_end();
  ASSERT_EQ(std::ssize(entries), file.count());
  double low = INFINITY;
  for (std::int64_t brick = 0; brick < file.count(); ++brick) {
    const IndexEntry expected = file.entry(brick), &entry = entries[static_cast<std::size_t>(brick)];
    ASSERT_EQ(entry.low, expected.low);
    ASSERT_EQ(entry.mean, expected.mean);
    ASSERT_EQ(block_frame_size + expected.activity_bytes + expected.value_bytes, file.block_bytes(brick));
    low = std::min(low, entry.low);
  }
  EXPECT_EQ(low, file.index().total.low);
}

TEST_F(TwoPages, AreTheSameBytesInParts) {
  Ranks alone;
  committed(encode_in_parts(alone, {.input = path("in.nrrd"),
                                    .output = path("parts.tag"),
                                    .options = options_,
                                    .resources = Resources(2)}));
  EXPECT_TRUE(content("parts.tag") == tag_);
}

TEST_F(TwoPages, ADamagedPageIsFoundAndCostsSalvageNothing) {
  const TagBricks good(std::make_shared<MemorySource>(tag_));
  const PageFacts& facts = good.index().pages[0];
  const std::uint64_t start = good.start(4095) + good.block_bytes(4095);
  const std::uint64_t size = facts.sizes_bytes + facts.statistics_bytes;
  const Box of_first = {{0, 0, 0}, {63, 63, 5}}, of_second = {{0, 0, 70}, {63, 63, 79}};
  for (std::uint64_t at = 0; at + 8 < size; at += sanitized ? 997 : 331) {
    SCOPED_TRACE(at);
    const std::string bad = flipped(tag_, start + at, 16);
    EXPECT_EQ(region(bad, of_second), original(of_second));
    if (at < facts.sizes_bytes)
      EXPECT_TRUE(has(message_of<BrokenInput>([&] { region(bad, of_first); }), "page 0 of the index"));
    else
      EXPECT_EQ(region(bad, of_first), original(of_first));
    write_content(path("bad.tag"), bad);
    const auto read = [&] { TagReader(path("bad.tag")).read_to_end(); };
    EXPECT_TRUE(has(message_of<BrokenInput>(read), "page 0 of the index"));
    const WholeBricks salvaged(std::make_shared<MemorySource>(bad));
    EXPECT_EQ(salvaged.whole_count(), good.count());
    EXPECT_TRUE(salvaged.is_damaged_elsewhere());
  }
  // The checksum on which the next brick depends.
  for (std::uint64_t at = size - 8; at < size; ++at) {
    const WholeBricks salvaged(std::make_shared<MemorySource>(flipped(tag_, start + at, 16)));
    EXPECT_EQ(salvaged.whole_count(), good.count());
    EXPECT_TRUE(salvaged.is_damaged_elsewhere());
  }
}

TEST_F(TwoPages, SalvageGoesOnBehindALostPage) {
  const TagBricks good(std::make_shared<MemorySource>(tag_));
  const std::uint64_t page = good.start(4095) + good.block_bytes(4095);
  const auto damaged = [&](std::initializer_list<std::uint64_t> places) {
    std::string bad = tag_;
    for (const std::uint64_t at : places) bad[at] = static_cast<char>(bad[at] ^ 64);
    return std::make_shared<MemorySource>(bad);
  };
  // The sizes and the length of a brick: the bricks behind it in its page are lost, and no others.
  const WholeBricks one(damaged({page + 30, good.start(4000) + 1}));
  EXPECT_EQ(one.lost(), (std::vector<BrickRun>{{4000, 4095}}));
  // A brick's bytes alone cost the brick.
  const WholeBricks two(damaged({good.start(17) + 8, good.start(4100) + 8}));
  EXPECT_EQ(two.lost(), (std::vector<BrickRun>{{17, 17}, {4100, 4100}}));
  // The directory is gone: all bricks up to the first damage.
  const WholeBricks three(damaged({tag_.size() - 40, good.start(4500) + 8}));
  EXPECT_FALSE(three.index().has_value());
  EXPECT_EQ(three.lost(), (std::vector<BrickRun>{{4500, 5119}}));
  // The end of the file is gone.
  const WholeBricks four(std::make_shared<MemorySource>(tag_.substr(0, good.start(4200) + 3)));
  EXPECT_EQ(four.lost(), (std::vector<BrickRun>{{4200, 5119}}));
}

}  // namespace
}  // namespace tagrid
