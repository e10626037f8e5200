
#include <ctime>
#include <iostream>
#include <set>

#include "io/errors/errors.h"
#include "io/metadata/text.h"
#include "pipeline/decode/graph.h"
#include "pipeline/overview/header.h"
#include "pipeline/preview/read_preview.h"
#include "stages/mesh/tetrahedra.h"
#include "tests/support/counted_heap.h"
#include "tests/support/repeated_tag.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/tag_in_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

class ReadPreview : public TemporaryFolder {
 protected:
  template <class T>
  void encode(Index3 dims, const EncodeOptions& options) {
    write_nrrd(path("in.nrrd"), dims, blobs<T>(dims, 3), "spacings: 1 2 3\n");
    encode_volume(path("in.nrrd"), {}, path("file.tag"), true, options, Resources(2));
    decode_volume(path("file.tag"), path("whole.nrrd"), format_named("nrrd"), true, Resources(2));
    source_ = std::make_shared<MemorySource>(file_content(path("file.tag")));
  }
  /// With a bound, so that bricks have their grid.
  static EncodeOptions small_bricks() {
    EncodeOptions options{.max_error = 1, .cube_size = 4, .brick_edge = 2};
    return options;
  }

  template <class T>
  void expect_slices(const PreviewContent& content) const {
    const auto whole = read_samples<T>(path("whole.nrrd"));
    const TagBricks file(source_);
    const Box volume = Box::of_size(file.parameters().dims);
    for (const PreviewSlice& slice : content.slices) {
      const Panel& p = slice.panel;
      const std::vector<double> values = values_of(slice, sample_type_of<T>());
      ASSERT_EQ(static_cast<std::int64_t>(values.size()), p.across.count() * p.down.count());
      for (int v = 0; v < p.down.pixels; ++v)
        for (int u = 0; u < p.across.pixels; ++u) {
          Index3 sample;
          sample[p.axis] = p.slice;
          sample[p.across.axis] = p.across.number(u) * p.across.step();
          sample[p.down.axis] = p.down.number(v) * p.down.step();
          ASSERT_EQ(
              values[static_cast<std::size_t>(p.down.number(v) * p.across.count() + p.across.number(u))],
              static_cast<double>(whole[static_cast<std::size_t>(volume.offset(sample))]));
        }
    }
  }

  std::shared_ptr<MemorySource> source_;
};

TEST_F(ReadPreview, GivesTheSamplesOfTheVolume) {
  for (const int largest : {300, 30, 7}) {  // pixels are fewer than samples, or more
    PreviewWishes wishes;
    wishes.largest = largest;
    wishes.least = 3;
    EncodeOptions options = small_bricks();
    encode<std::int16_t>({37, 45, 29}, options);
    expect_slices<std::int16_t>(read_preview(TagBricks(source_), wishes, Resources(2), 0));
    wishes.slices = {36, 0, 17};
    expect_slices<std::int16_t>(read_preview(TagBricks(source_), wishes, Resources(2), 0));
    options.max_error.reset();
    options.grid_only = true;
    encode<float>({37, 45, 29}, options);
    expect_slices<float>(read_preview(TagBricks(source_), wishes, Resources(2), 0));
  }
}

TEST_F(ReadPreview, TakesSlicesFromTheCoarsestOverviewThatShowsAsMuch) {
  EncodeOptions options = small_bricks();
  options.overviews = {4, 16};
  encode<std::int16_t>({128, 90, 70}, options);
  Ranks alone;
  committed(decode_volume(alone, {.input = path("file.tag"),
                                  .output = path("level.nrrd"),
                                  .format = format_named("nrrd"),
                                  .overview = 4,
                                  .resources = Resources(2)}));
  const auto level = read_samples<std::int16_t>(path("level.nrrd"));
  const TagBricks file(source_);
  const Box blocks = Box::of_size(file.nested(file.index().members.at(0))->parameters().dims);
  PreviewWishes wishes;
  wishes.largest = 40;
  wishes.least = 3;
  const PreviewContent content = read_preview(file, wishes, Resources(2), 0);
  for (const PreviewSlice& slice : content.slices) {
    const Panel& p = slice.panel;
    ASSERT_EQ(p.block(), 4);
    const std::vector<double> values = values_of(slice, SampleType::int16);
    for (int v = 0; v < p.down.pixels; ++v)
      for (int u = 0; u < p.across.pixels; ++u) {
        Index3 at;
        at[p.axis] = p.slice / 4;
        at[p.across.axis] = p.across.place(u) / PanelAxis::parts / 4;
        at[p.down.axis] = p.down.place(v) / PanelAxis::parts / 4;
        const double value =
            values[static_cast<std::size_t>(p.down.number(v) * p.across.count() + p.across.number(u))];
        const auto mean_at = [&](Index3 block) {
          return static_cast<double>(level[static_cast<std::size_t>(blocks.offset(block))]);
        };
        // A pixel shows the nearest sample, which may be in the next block.
        bool is_near = false;
        for (const int i : {0, 1})
          for (const int j : {0, 1}) {
            Index3 block = at;
            block[p.across.axis] = std::min(block[p.across.axis] + i, blocks.high[p.across.axis]);
            block[p.down.axis] = std::min(block[p.down.axis] + j, blocks.high[p.down.axis]);
            is_near = is_near || value == mean_at(block);
          }
        ASSERT_TRUE(is_near);
      }
  }
  EXPECT_EQ(content.levels.panel.block(), 1);
  wishes.largest = 110;
  for (const PreviewSlice& slice : read_preview(file, wishes, Resources(2), 0).slices)
    EXPECT_EQ(slice.panel.block(), 1);
}

TEST_F(ReadPreview, ReadsEachBrickOfTheSlicesOnceAndNothingElse) {
  encode<std::uint8_t>({37, 45, 29}, small_bricks());
  const TagBricks file(source_);
  source_->reads();
  const PreviewContent content = read_preview(file, {}, Resources(3), 0);
  const BrickGrid bricks = file.parameters().bricks();
  std::multiset<std::pair<std::uint64_t, std::uint64_t>> expected;
  const auto last = bricks.count() - 1;
  const std::uint64_t page = file.start(last) + file.block_bytes(last);
  expected.emplace(page - 8, page + file.index().pages.at(0).sizes_bytes);
  for (std::int64_t id = 0; id < bricks.count(); ++id) {
    const Box owned = bricks.domain.samples_at(bricks.owned_box(bricks.position(id)));
    bool shown = false;
    for (const PreviewSlice& slice : content.slices)
      shown = shown || (owned.low[slice.panel.axis] <= slice.panel.slice &&
                        slice.panel.slice <= owned.high[slice.panel.axis]);
    // And the checksum before.
    if (shown) expected.emplace(file.start(id) - 8, file.start(id) + file.block_bytes(id));
  }
  const auto reads = source_->reads();
  EXPECT_EQ((std::multiset(reads.begin(), reads.end())), expected);
  EXPECT_EQ(content.bricks, static_cast<std::int64_t>(expected.size()) - 1);
  EXPECT_LT(content.bricks, bricks.count());
}

TEST_F(ReadPreview, APixelHasTheLevelOfTheLeafAtItsPlace) {
  encode<std::uint8_t>({23, 17, 12}, small_bricks());
  const TagBricks file(source_);
  const CodingParameters& parameters = file.parameters();
  std::vector<Tetrahedron> leaves;
  for (std::int64_t id = 0; id < file.count(); ++id) {
    const DecodedBrick brick = decode_block(file.read(id), parameters, "", Wanted::samples_and_grid);
    for_each_leaf_tetrahedron(brick.active, brick.active.box(), 4, 6,
                              [&](const Tetrahedron& t) { leaves.push_back(t); });
  }
  std::set<int> levels;
  std::mt19937 random(5);
  // The grid of a lossless file is the same, but computed.
  EncodeOptions lossless = small_bricks();
  lossless.max_error = 0;
  const std::shared_ptr<MemorySource> bounded = source_;
  encode<std::uint8_t>({23, 17, 12}, lossless);
  for (const auto& [z, source] :
       {std::pair{0, bounded}, {0, source_}, {1, source_}, {8, bounded}, {11, source_}}) {
    PreviewWishes wishes;
    wishes.slices[2] = z;
    const PreviewContent content = read_preview(TagBricks(source), wishes, Resources(2), 0);
    const Panel& p = content.slices[2].panel;
    ASSERT_EQ(content.leaves.size(), static_cast<std::size_t>(p.across.pixels * p.down.pixels));
    for (int i = 0; i < 150; ++i) {
      const int u = static_cast<int>(random() % static_cast<unsigned>(p.across.pixels)),
                v = static_cast<int>(random() % static_cast<unsigned>(p.down.pixels));
      const std::int64_t parts = PanelAxis::parts;
      const Index3 place = parts * parameters.domain().first() +
                           Index3{p.across.place(u), p.down.place(v), z == 0 ? 1 : z * parts - 1};
      std::set<int> possible;
      for (const Tetrahedron& leaf : leaves) {
        bool inside = true;
        for (std::size_t k = 0; k < 4 && inside; ++k) {
          std::array<Index3, 4> part;
          for (std::size_t j = 0; j < 4; ++j) part[j] = j == k ? place : parts * leaf.vertices[j];
          inside = six_volumes(part) >= 0;
        }
        if (inside) possible.insert(leaf.level);
      }
      const LeafPixel& pixel = content.leaves[static_cast<std::size_t>(v * p.across.pixels + u)];
      EXPECT_TRUE(possible.contains(pixel.level)) << u << " " << v << " " << z;
      levels.insert(pixel.level);
    }
  }
  EXPECT_GT(levels.size(), 3U);
}

TEST_F(ReadPreview, WhereSamplesAreLeftOutTheLevelsAreThoseOfTheMiddle) {
  encode<std::uint8_t>({37, 45, 29}, small_bricks());
  PreviewWishes wishes;
  wishes.largest = 20;
  wishes.least = 1;
  const TagBricks file(source_);
  const PreviewContent content = read_preview(file, wishes, Resources(2), 0);
  expect_slices<std::uint8_t>(content);
  const Panel &whole = content.slices[2].panel, &part = content.levels.panel;
  ASSERT_TRUE(whole.leaves_out());
  EXPECT_EQ(part.slice, whole.slice);
  EXPECT_LT(part.across.samples, 10);
  // Each sample of the part, from the whole volume, and a leaf of a brick there.
  const auto samples = read_samples<std::uint8_t>(path("whole.nrrd"));
  const std::vector<double> values = values_of(content.levels, SampleType::uint8);
  for (std::int64_t y = 0; y < part.down.samples; ++y)
    for (std::int64_t x = 0; x < part.across.samples; ++x) {
      const Index3 p{part.across.first + x, part.down.first + y, part.slice};
      EXPECT_EQ(values[static_cast<std::size_t>(y * part.across.samples + x)],
                samples[static_cast<std::size_t>(Box::of_size(file.parameters().dims).offset(p))]);
    }
  ASSERT_EQ(content.leaves.size(), static_cast<std::size_t>(part.across.pixels * part.down.pixels));
  for (const LeafPixel& pixel : content.leaves) EXPECT_NE(pixel.leaf, 0U);
}

TEST_F(ReadPreview, OfALargeSliceTheFirstOneOfALayerOfBricksIsShownIfItIsNearTheMiddle) {
  EncodeOptions options = small_bricks();
  const auto slice_of = [&](std::int64_t slices, int largest, std::optional<std::int64_t> wish = {}) {
    encode<std::uint8_t>({20, 20, slices}, options);
    PreviewWishes wishes;
    wishes.largest = largest;
    wishes.least = 1;
    wishes.slices[2] = wish;
    const PreviewContent content = read_preview(TagBricks(source_), wishes, Resources(2), 0);
    expect_slices<std::uint8_t>(content);
    return content.slices[2].panel.slice;
  };
  // Layers of bricks own the slices 0 to 7, 8 to 15, 16 to 23, ...
  EXPECT_EQ(slice_of(32, 8), 16);
  EXPECT_EQ(slice_of(32, 300), 16);
  EXPECT_EQ(slice_of(32, 8, 16), 16);
  EXPECT_EQ(slice_of(41, 8), 20);   // 16 is 4 of 41 away
  EXPECT_EQ(slice_of(121, 8), 56);  // instead of 60
  EXPECT_EQ(slice_of(127, 8), 64);  // instead of 63
  EXPECT_EQ(slice_of(3, 8), 1);
}

TEST_F(ReadPreview, AFileWithoutAGridHasNoLevels) {
  EncodeOptions options = small_bricks();
  options.grid = GridOrigin::derived;
  encode<std::uint8_t>({23, 17, 12}, options);
  const PreviewContent content = read_preview(TagBricks(source_), {}, Resources(2), 0);
  EXPECT_TRUE(content.leaves.empty());
  expect_slices<std::uint8_t>(content);
}

TEST_F(ReadPreview, ALimitOnMemoryIsKeptOrRefusedWithTheSmallestOne) {
  encode<std::int16_t>({37, 45, 29}, small_bricks());
  Resources resources(4);
  resources.memory = 1;
  try {
    read_preview(TagBricks(source_), {}, resources, 1000);
    FAIL();
  } catch (const MemoryLimit& limit) {
    resources.memory = limit.needs().needed;
  }
  EXPECT_EQ(read_preview(TagBricks(source_), {}, resources, 1000).memory, *resources.memory);
  EXPECT_THROW(read_preview(TagBricks(source_), {}, resources, 1001), MemoryLimit);
}

TEST_F(ReadPreview, DamageInABrickThatIsShownIsAnError) {
  encode<std::int16_t>({37, 45, 29}, small_bricks());
  const std::string good = content("file.tag");
  const TagBricks file(source_);
  const BrickGrid bricks = file.parameters().bricks();
  const auto damaged = [&](Index3 position) {
    return std::make_shared<MemorySource>(flipped(good, file.start(bricks.id(position)) + 20, 4));
  };
  const std::int64_t middle = bricks.owner(29 / 2 + bricks.domain.first().z);
  EXPECT_THROW(read_preview(TagBricks(damaged({1, 1, middle})), {}, Resources(2), 0), BrokenInput);
  EXPECT_NO_THROW(read_preview(TagBricks(damaged({0, 0, 0})), {}, Resources(2), 0));
}

// A preview of a terabyte reads a few bricks of it, whatever it has besides.

class LargePreview : public TemporaryFolder {
 protected:
  // Bricks in the middle of a phantom, and of its overview, which has means of less noise.
  void make_bricks() {
    write_phantom({.dims = {256, 256, 256}, .type = SampleType::int16, .seed = 3}, path("in.nrrd"),
                  format_named("nrrd"), true, 2);
    const EncodeOptions options{.max_error = 2, .overviews = std::vector{4}};
    encode_volume(path("in.nrrd"), {}, path("a.tag"), true, options, Resources(2));
    const TagBricks file(std::make_shared<FileSource>(path("a.tag")));
    samples_ = file.read(file.parameters().bricks().id({1, 1, 1}));
    means_ = file.nested(file.index().members.at(0))->read(7);
  }
  // A volume of these dims, with the overviews that it has by default.
  std::shared_ptr<RepeatedTag> file_of(const Index3& dims) const {
    TagHeader header = {{.dims = dims,
                         .type = SampleType::int16,
                         .cube_size = 32,
                         .brick_edge = 2,
                         .max_level = max_level(32),
                         .range_low = -1024,
                         .range_high = 3072,
                         .field_scale = 8.0 / 4096,
                         .max_error = 2},
                        parse_metadata("spacings: 1 1 1\n")};
    header.parameters.lead = 1;
    std::vector<RepeatedTag::Overview> overviews;
    for (const int factor : factors_for(dims)) {
      // Nothing reads the finest one, which would be too large.
      const BrickBytes one = factor == 4 ? BrickBytes{0, {}, {0, 5, 0}} : means_;
      overviews.push_back({static_cast<std::uint32_t>(factor),
                           file_of_equal_bricks(overview_header(header, factor, {}), one)});
    }
    return std::make_shared<RepeatedTag>(header, samples_, overviews);
  }
  void expect_few(const Index3& dims, std::uint64_t bytes) const {
    const auto source = file_of(dims);
    EXPECT_GT(source->size(), std::uint64_t{100} << 30);
    const HeapPeak heap;
    const std::clock_t start = std::clock();
    const TagBricks file(source);
    const PreviewContent content = read_preview(file, {}, Resources(2), 0);
    std::cout << heap.bytes() << " bytes of heap, " << source->bytes_read() << " bytes read, "
              << content.bricks << " bricks, " << static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC
              << " s of all threads\n";
    EXPECT_LT(source->bytes_read(), bytes);
    EXPECT_LT(heap.bytes(), sanitized ? 100'000'000U : 20'000'000U);
    for (const PreviewSlice& slice : content.slices) EXPECT_GE(slice.panel.block(), 16);
    EXPECT_FALSE(content.leaves.empty());
  }

  BrickBytes samples_, means_;
};

TEST_F(LargePreview, OfATerabyteReadsAFewMegabytes) {
  make_bricks();
  expect_few({16384, 8192, 4096}, 4'000'000);
  // A cube has the largest slices.
  expect_few({8192, 8192, 8192}, 10'000'000);
}

}  // namespace
}  // namespace tagrid
