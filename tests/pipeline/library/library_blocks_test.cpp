// The half of the library that reads a block at a time: the caller fetches the bytes.
#include <filesystem>
#include <fstream>
#include <iterator>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "stages/sample/sample_type.h"
#include "tagrid/tagrid.h"
#include "tagrid/tagrid_blocks.h"
#include "tests/pipeline/library/library_calls.h"
#include "tests/support/counted_heap.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

using Bytes = std::vector<unsigned char>;

Bytes content_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<std::filesystem::path> golden_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(TAGRID_SOURCE_DIR "/tests/golden/1.0"))
    if (entry.path().extension() == ".tag") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// A file as a caller that fetches what a call lacks.
class Fetching {
 public:
  explicit Fetching(const Bytes& file) : file_(file) {}

  /// Repeats a call of `blocks` until it does not lack bytes.
  template <class Call>
  tagrid_status operator()(tagrid_blocks* blocks, Call call) {
    for (int round = 0; round < 100; ++round) {
      const tagrid_status status = call();
      if (status != TAGRID_NEEDS_BYTES) return status;
      const tagrid_range* ranges = nullptr;
      const std::size_t count = tagrid_blocks_needs(blocks, &ranges);
      EXPECT_GT(count, 0U);
      for (const tagrid_range& range : std::vector<tagrid_range>(ranges, ranges + count)) {
        EXPECT_LE(range.offset + range.bytes, file_.size());
        fetched += range.bytes;
        ++fetches;
        EXPECT_EQ(tagrid_blocks_give(blocks, range.offset, file_.data() + range.offset, range.bytes),
                  TAGRID_OK);
      }
    }
    ADD_FAILURE() << "the same bytes are asked for again and again";
    return TAGRID_BUG;
  }

  std::uint64_t fetched = 0;
  int fetches = 0;

 private:
  const Bytes& file_;
};

struct Blocks {
  explicit Blocks(std::uint64_t size) { tagrid_blocks_create(size, &handle); }
  explicit Blocks(tagrid_blocks* given) : handle(given) {}
  ~Blocks() { tagrid_blocks_close(handle); }
  Blocks(const Blocks&) = delete;
  tagrid_blocks* handle = nullptr;
};

/// A golden file, open.
struct OpenBlocks {
  explicit OpenBlocks(const std::filesystem::path& path) : file(content_of(path)) {
    EXPECT_EQ(fetching(blocks.handle, [&] { return tagrid_blocks_open(blocks.handle); }), TAGRID_OK);
  }

  const Bytes file;
  Fetching fetching{file};
  const Blocks blocks{file.size()};
};

struct Decoder {
  explicit Decoder(const tagrid_blocks* blocks) {
    std::size_t bytes = 0;
    const void* header = tagrid_blocks_header(blocks, &bytes);
    EXPECT_EQ(tagrid_decoder_open(header, bytes, &handle), TAGRID_OK);
  }
  ~Decoder() { tagrid_decoder_close(handle); }
  Decoder(const Decoder&) = delete;
  tagrid_decoder* handle = nullptr;
};

tagrid_info info_of(tagrid_blocks* blocks) {
  tagrid_info info;
  tagrid_info_init(&info);
  EXPECT_EQ(tagrid_blocks_info(blocks, &info), TAGRID_OK);
  return info;
}

tagrid_box box_of(tagrid_blocks* blocks) {
  const tagrid_info info = info_of(blocks);
  return whole_box({info.dims[0], info.dims[1], info.dims[2]});
}

std::vector<tagrid_block> planned(Fetching& fetching, tagrid_blocks* blocks, const tagrid_box& box) {
  std::vector<tagrid_block> all, some(7);
  for (std::size_t count = some.size(); count == some.size();) {
    EXPECT_EQ(fetching(blocks,
                       [&] {
                         return tagrid_blocks_plan(blocks, &box, static_cast<std::int64_t>(all.size()),
                                                   some.data(), some.size(), &count);
                       }),
              TAGRID_OK)
        << tagrid_blocks_message(blocks);
    all.insert(all.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(count));
  }
  return all;
}

/// The samples of a box, from single blocks.
Bytes samples_by_blocks(const Bytes& file, Fetching& fetching, tagrid_blocks* blocks, const tagrid_box& box) {
  const tagrid_info info = info_of(blocks);
  const std::size_t size = tagrid_sample_size(info.type);
  std::int64_t shape[3];
  for (int axis = 0; axis < 3; ++axis) shape[axis] = box.high[axis] - box.low[axis];
  Bytes result(static_cast<std::size_t>(shape[0] * shape[1] * shape[2]) * size);
  const Decoder decoder(blocks);
  for (const tagrid_block& block : planned(fetching, blocks, box)) {
    const void* samples = nullptr;
    std::size_t count = 0;
    EXPECT_EQ(tagrid_decoder_decode(decoder.handle, &block, file.data() + block.range.offset,
                                    block.range.bytes, &samples, &count),
              TAGRID_OK)
        << tagrid_decoder_message(decoder.handle);
    const auto* from = static_cast<const unsigned char*>(samples);
    const std::int64_t nx = block.box.high[0] - block.box.low[0], ny = block.box.high[1] - block.box.low[1];
    EXPECT_GE(count, static_cast<std::size_t>(nx * ny * block.slices) * size);
    for (std::int64_t z = std::max(block.box.low[2], box.low[2]);
         z < std::min(block.box.high[2], box.high[2]); ++z)
      for (std::int64_t y = std::max(block.box.low[1], box.low[1]);
           y < std::min(block.box.high[1], box.high[1]); ++y) {
        const std::int64_t x = std::max(block.box.low[0], box.low[0]),
                           end = std::min(block.box.high[0], box.high[0]);
        const std::int64_t to = ((z - box.low[2]) * shape[1] + y - box.low[1]) * shape[0] + x - box.low[0],
                           at = ((z - block.box.low[2]) * ny + y - block.box.low[1]) * nx + x -
                                block.box.low[0];
        std::memcpy(result.data() + static_cast<std::size_t>(to) * size,
                    from + static_cast<std::size_t>(at) * size, static_cast<std::size_t>(end - x) * size);
      }
  }
  return result;
}

Bytes samples_by_reader(const tagrid_reader* reader, const tagrid_box& box, tagrid_type type) {
  std::size_t count = tagrid_sample_size(type);
  for (int axis = 0; axis < 3; ++axis) count *= static_cast<std::size_t>(box.high[axis] - box.low[axis]);
  Bytes samples(count);
  tagrid_call call;
  tagrid_call_init(&call);
  call.threads = 1;
  EXPECT_EQ(tagrid_reader_read(reader, &box, nullptr, type, samples.data(), nullptr, &call), TAGRID_OK);
  return samples;
}

void same_samples(const Bytes& file, tagrid_blocks* blocks, const tagrid_reader* reader) {
  Fetching fetching(file);
  const tagrid_info info = info_of(blocks);
  std::mt19937 random(1);
  tagrid_box box = box_of(blocks);
  for (int i = 0; i < 3; ++i, box = any_box({info.dims[0], info.dims[1], info.dims[2]}, random))
    EXPECT_EQ(samples_by_blocks(file, fetching, blocks, box), samples_by_reader(reader, box, info.type));
}

TEST(LibraryBlocks, SamplesAreThoseOfTheReader) {
  for (const auto& path : golden_files()) {
    SCOPED_TRACE(path.filename());
    OpenBlocks open(path);
    auto& [file, fetching, blocks] = open;
    tagrid_reader* reader = nullptr;
    ASSERT_EQ(tagrid_reader_open_file(path.c_str(), &reader), TAGRID_OK);
    const tagrid_info info = info_of(blocks.handle);
    const tagrid_info expected = tagrid::info_of(reader);
    EXPECT_EQ(std::memcmp(&info, &expected, sizeof info), 0);
    EXPECT_STREQ(tagrid_blocks_metadata(blocks.handle), tagrid_reader_metadata(reader));
    same_samples(file, blocks.handle, reader);

    std::int64_t factors[TAGRID_MOST_OVERVIEWS], volumes = 0;
    ASSERT_EQ(tagrid_blocks_overviews(blocks.handle, factors), TAGRID_OK);
    const auto same_part = [&](std::int64_t number, auto of_blocks, auto of_reader) {
      tagrid_blocks* nested = nullptr;
      tagrid_reader* other = nullptr;
      tagrid_blocks* const whole = open.blocks.handle;
      ASSERT_EQ(open.fetching(whole, [&] { return of_blocks(whole, number, &nested); }), TAGRID_OK);
      ASSERT_EQ(of_reader(reader, number, &other), TAGRID_OK);
      const Blocks part(nested);
      same_samples(open.file, part.handle, other);
      tagrid_reader_close(other);
    };
    for (const std::int64_t* factor = factors; *factor != 0; ++factor)
      same_part(*factor, tagrid_blocks_overview, tagrid_reader_overview);
    ASSERT_EQ(tagrid_blocks_volumes(blocks.handle, &volumes), TAGRID_OK);
    for (std::int64_t number = 0; number < volumes; ++number)
      same_part(number, tagrid_blocks_volume, tagrid_reader_volume);
    tagrid_reader_close(reader);
  }
}

TEST(LibraryBlocks, OpeningFetchesTheTwoEnds) {
  OpenBlocks open(TAGRID_SOURCE_DIR "/tests/golden/1.0/pages_lossless_uint8.tag");
  auto& [file, fetching, blocks] = open;
  EXPECT_EQ(fetching.fetches, 2);
  // Bytes are forgotten; the pages that were read are kept.
  const tagrid_box box = {{0, 0, 0}, {1, 1, 1}};
  planned(fetching, blocks.handle, box);
  EXPECT_EQ(fetching.fetches, 3);
  planned(fetching, blocks.handle, box);
  EXPECT_EQ(fetching.fetches, 3);
}

TEST(LibraryBlocks, DecodingTakesNoMoreMemoryThanItSays) {
  for (const auto& path : golden_files()) {
    SCOPED_TRACE(path.filename());
    OpenBlocks open(path);
    auto& [file, fetching, blocks] = open;
    const Decoder decoder(blocks.handle);
    for (const tagrid_block& block : planned(fetching, blocks.handle, box_of(blocks.handle))) {
      const void* samples = nullptr;
      std::size_t count = 0;
      const HeapPeak peak;
      ASSERT_EQ(tagrid_decoder_decode(decoder.handle, &block, file.data() + block.range.offset,
                                      block.range.bytes, &samples, &count),
                TAGRID_OK);
      EXPECT_LE(peak.bytes(), tagrid_decoder_memory(decoder.handle, &block));
      // It is no idle promise.
      EXPECT_LE(count, tagrid_decoder_memory(decoder.handle, &block));
      if (tagrid_blocks_stores_grid(blocks.handle) == 0) continue;
      tagrid_box box;
      const std::uint64_t* words = nullptr;
      const HeapPeak grid_peak;
      ASSERT_EQ(tagrid_decoder_activity(decoder.handle, &block, file.data() + block.range.offset,
                                        block.range.bytes, &box, &words, &count),
                TAGRID_OK);
      EXPECT_LE(grid_peak.bytes(), tagrid_decoder_activity_memory(decoder.handle, &block));
    }
  }
}

TEST(LibraryBlocks, EdgesTakeNoMoreMemoryThanIsPromised) {
  OpenBlocks open(TAGRID_SOURCE_DIR "/tests/golden/1.0/lead_voxels_bounded_int16.tag");
  auto& [file, fetching, blocks] = open;
  const Decoder decoder(blocks.handle);
  std::mt19937 random(4);
  int bricks = 0;
  for (const tagrid_block& block : planned(fetching, blocks.handle, box_of(blocks.handle))) {
    ++bricks;
    tagrid_box box;
    const std::uint64_t* words = nullptr;
    std::size_t size = 0;
    ASSERT_EQ(tagrid_decoder_activity(decoder.handle, &block, file.data() + block.range.offset,
                                      block.range.bytes, &box, &words, &size),
              TAGRID_OK);
    std::vector<std::uint64_t> none(size), some(size), all(size, ~std::uint64_t{0});
    for (std::uint64_t& word : some) word = std::uint64_t{random()} << 32 | random() | random();
    for (const auto* active : {&none, &some, &all})
      for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t* edges = nullptr;
        std::size_t count = 0;
        const HeapPeak peak;
        ASSERT_EQ(tagrid_decoder_edges(decoder.handle, block.number, active->data(), size, axis,
                                       block.box.low[axis], &edges, &count),
                  TAGRID_OK);
        std::uint64_t points = 1;
        for (int other = 0; other < 3; ++other)
          if (other != axis) points *= static_cast<std::uint64_t>(box.high[other] - box.low[other]);
        EXPECT_LE(peak.bytes(), 6144 * points);
        // It is no idle promise. Sanitizers count their own heap.
        if (active == &all && !sanitized) {
          EXPECT_GT(peak.bytes(), 600 * points);
        }
      }
  }
  EXPECT_GT(bricks, 0);
}

TEST(LibraryBlocks, DamageIsBrokenInput) {
  const Bytes whole = content_of(TAGRID_SOURCE_DIR "/tests/golden/1.0/lead_voxels_overviews_int16.tag");
  std::mt19937 random(2);
  for (int i = 0; i < 300; ++i) {
    Bytes file = whole;
    const std::size_t at = random() % file.size();
    file[at] = static_cast<unsigned char>(file[at] ^ (1U << random() % 8));
    if (i % 5 == 0) file.resize(at);
    Fetching fetching(file);
    const Blocks blocks(file.size());
    const tagrid_status opened = fetching(blocks.handle, [&] { return tagrid_blocks_open(blocks.handle); });
    if (opened != TAGRID_OK) {
      EXPECT_EQ(opened, TAGRID_BROKEN_INPUT);
      EXPECT_STRNE(tagrid_blocks_message(blocks.handle), "");
      continue;
    }
    const tagrid_box box = box_of(blocks.handle);
    tagrid_block some[64];
    std::size_t count = 0;
    const tagrid_status plan = fetching(blocks.handle, [&] {
      return tagrid_blocks_plan(blocks.handle, &box, 0, some, std::size(some), &count);
    });
    if (plan != TAGRID_OK) {
      EXPECT_EQ(plan, TAGRID_BROKEN_INPUT);
      continue;
    }
    const Decoder decoder(blocks.handle);
    for (const tagrid_block& block : std::vector<tagrid_block>(some, some + count)) {
      const void* samples = nullptr;
      std::size_t bytes = 0;
      const tagrid_status status = tagrid_decoder_decode(
          decoder.handle, &block, file.data() + block.range.offset, block.range.bytes, &samples, &bytes);
      const bool is_hit = at >= block.range.offset && at < block.range.offset + block.range.bytes;
      EXPECT_EQ(status, is_hit ? TAGRID_BROKEN_INPUT : TAGRID_OK);
      EXPECT_EQ(samples == nullptr, is_hit);
    }
  }
}

TEST(LibraryBlocks, ANewerFileHasAStatusOfItsOwn) {
  Bytes file = content_of(TAGRID_SOURCE_DIR "/tests/golden/1.0/example_int16.tag");
  auto* const header = reinterpret_cast<std::byte*>(file.data());
  const auto size = load_little_endian<std::uint32_t>(header + 12);
  file[8] = 6;
  const auto opened = [&] {
    Fetching fetching(file);
    const Blocks blocks(file.size());
    return fetching(blocks.handle, [&] { return tagrid_blocks_open(blocks.handle); });
  };
  EXPECT_EQ(opened(), TAGRID_BROKEN_INPUT) << "the checksum is not right";
  store_little_endian(header + size - 8, checksum_of({std::span(header, size - 8)}));
  EXPECT_EQ(opened(), TAGRID_NEWER_FORMAT);
  tagrid_decoder* decoder = nullptr;
  EXPECT_EQ(tagrid_decoder_open(header, size, &decoder), TAGRID_NEWER_FORMAT);
  tagrid_decoder_close(decoder);
  EXPECT_STREQ(tagrid_status_text(TAGRID_NEWER_FORMAT), "a newer version of the format");
}

TEST(LibraryBlocks, MistakesOfACallerAreRefused) {
  const Bytes file = content_of(TAGRID_SOURCE_DIR "/tests/golden/1.0/voxels_bounded_int16.tag");
  Fetching fetching(file);
  const Blocks blocks(file.size());
  tagrid_info info;
  tagrid_info_init(&info);
  EXPECT_EQ(tagrid_blocks_info(blocks.handle, &info), TAGRID_INVALID_ARGUMENT);
  EXPECT_STREQ(tagrid_blocks_message(blocks.handle), "the file is not open");
  EXPECT_EQ(tagrid_blocks_give(blocks.handle, file.size(), file.data(), 1), TAGRID_INVALID_ARGUMENT);
  ASSERT_EQ(fetching(blocks.handle, [&] { return tagrid_blocks_open(blocks.handle); }), TAGRID_OK);
  tagrid_block block = {};
  std::size_t count = 0;
  const tagrid_box outside = {{0, 0, 0}, {1, 1, 1 << 20}};
  EXPECT_EQ(tagrid_blocks_plan(blocks.handle, &outside, 0, &block, 1, &count), TAGRID_INVALID_ARGUMENT);
  tagrid_blocks* nested = nullptr;
  EXPECT_EQ(tagrid_blocks_overview(blocks.handle, 3, &nested), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(tagrid_blocks_volume(blocks.handle, 1, &nested), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(nested, nullptr);

  const Decoder decoder(blocks.handle);
  const void* samples = nullptr;
  block = planned(fetching, blocks.handle, {{0, 0, 0}, {1, 1, 1}})[0];
  const auto decode = [&](const tagrid_block& b, std::size_t bytes) {
    return tagrid_decoder_decode(decoder.handle, &b, file.data() + block.range.offset, bytes, &samples,
                                 &count);
  };
  EXPECT_EQ(decode(block, block.range.bytes), TAGRID_OK);
  EXPECT_EQ(decode(block, block.range.bytes - 1), TAGRID_INVALID_ARGUMENT);
  tagrid_block other = block;
  other.number = 1 << 20;
  EXPECT_EQ(decode(other, block.range.bytes), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(tagrid_decoder_memory(decoder.handle, &other), 0U);
  // A block of another brick has another checksum.
  other.number = block.number + 1;
  EXPECT_EQ(decode(other, block.range.bytes), TAGRID_BROKEN_INPUT);

  tagrid_box box;
  const std::uint64_t* words = nullptr;
  const std::int64_t* edges = nullptr;
  const auto activity = [&](std::size_t bytes) {
    return tagrid_decoder_activity(decoder.handle, &block, file.data() + block.range.offset, bytes, &box,
                                   &words, &count);
  };
  EXPECT_EQ(activity(block.range.bytes - 1), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(words, nullptr);
  ASSERT_EQ(activity(block.range.bytes), TAGRID_OK);
  const std::vector<std::uint64_t> active(words, words + count);
  for (int axis = 0; axis < 3; ++axis) EXPECT_LE(block.box.high[axis], box.high[axis]);
  const auto cut = [&](std::int64_t number, std::size_t size, int axis, std::int64_t slice) {
    return tagrid_decoder_edges(decoder.handle, number, active.data(), size, axis, slice, &edges, &count);
  };
  EXPECT_EQ(cut(block.number, active.size(), 2, block.box.high[2] - 1), TAGRID_OK);
  EXPECT_GT(count, 0U);
  EXPECT_EQ(cut(block.number, active.size(), 2, block.box.high[2]), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(cut(block.number, active.size(), 2, INT64_MAX), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(cut(block.number, active.size(), 2, INT64_MIN), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(cut(block.number, active.size(), 3, 0), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(cut(block.number, active.size() - 1, 2, 0), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(cut(1 << 20, active.size(), 2, 0), TAGRID_INVALID_ARGUMENT);
  EXPECT_EQ(edges, nullptr);

  tagrid_decoder* foreign = nullptr;
  EXPECT_EQ(tagrid_decoder_open("not a header", 12, &foreign), TAGRID_BROKEN_INPUT);
  EXPECT_EQ(decode(block, block.range.bytes), TAGRID_OK);
  tagrid_decoder_close(foreign);
}

}  // namespace
}  // namespace tagrid
