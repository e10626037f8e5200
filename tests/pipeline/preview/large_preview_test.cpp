// A preview of a terabyte reads a few bricks of it, whatever it has besides.
#include <gtest/gtest.h>

#include <ctime>
#include <iostream>
#include <memory>

#include "io/metadata/text.h"
#include "pipeline/overview/header.h"
#include "pipeline/preview/read_preview.h"
#include "tests/support/counted_heap.h"
#include "tests/support/repeated_tag.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

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
