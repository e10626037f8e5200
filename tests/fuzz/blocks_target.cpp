// The first six bytes of the input say which box is read, the rest is a .tag file. A caller that fetches
// what the library lacks gets what a reader gives, or both fail.
#include <algorithm>
#include <cstring>
#include <vector>

#include "tagrid/tagrid.h"
#include "tagrid/tagrid_blocks.h"
#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {
namespace {

// Larger bricks and boxes are not decoded: a file of a few bytes can describe them, but they take too long.
constexpr std::uint64_t most_memory = 8 << 20;
constexpr std::size_t most_samples = 1 << 16, most_bricks = 64;

/// Repeats a call until it does not lack bytes.
template <class Call>
tagrid_status with_bytes(Bytes file, tagrid_blocks* blocks, Call call) {
  for (int round = 0; round < 100; ++round) {
    const tagrid_status status = call();
    if (status != TAGRID_NEEDS_BYTES) return status;
    const tagrid_range* ranges = nullptr;
    const std::size_t count = tagrid_blocks_needs(blocks, &ranges);
    claim(count > 0, "a call that lacks bytes says which");
    for (const tagrid_range& range : std::vector<tagrid_range>(ranges, ranges + count)) {
      claim(range.offset <= file.size() && range.bytes <= file.size() - range.offset,
            "all bytes that are asked for are in the file");
      tagrid_blocks_give(blocks, range.offset, file.data() + range.offset,
                         static_cast<std::size_t>(range.bytes));
    }
  }
  claim(false, "bytes that were given are not asked for again and again");
  return TAGRID_BUG;
}

struct Blocks {
  explicit Blocks(std::uint64_t size) { tagrid_blocks_create(size, &handle); }
  ~Blocks() { tagrid_blocks_close(handle); }
  Blocks(const Blocks&) = delete;
  tagrid_blocks* handle = nullptr;
};

struct Decoder {
  explicit Decoder(const tagrid_blocks* blocks) {
    std::size_t bytes = 0;
    const void* header = tagrid_blocks_header(blocks, &bytes);
    claim(tagrid_decoder_open(header, bytes, &handle) == TAGRID_OK,
          "the header of an open file opens a decoder");
  }
  ~Decoder() { tagrid_decoder_close(handle); }
  Decoder(const Decoder&) = delete;
  tagrid_decoder* handle = nullptr;
};

struct Reader {
  explicit Reader(Bytes file) : bytes(file) {
    tagrid_input input;
    tagrid_input_init(&input);
    input.user = this;
    input.size = [](void* user, std::uint64_t* size) {
      *size = static_cast<Reader*>(user)->bytes.size();
      return 0;
    };
    input.read_at = [](void* user, std::uint64_t offset, void* buffer, std::size_t count) {
      std::memcpy(buffer, static_cast<Reader*>(user)->bytes.data() + offset, count);
      return 0;
    };
    status = tagrid_reader_open(&input, &handle);
  }
  ~Reader() { tagrid_reader_close(handle); }
  Reader(const Reader&) = delete;
  Bytes bytes;
  tagrid_reader* handle = nullptr;
  tagrid_status status;
};

struct Answer {
  bool is_known = false;  ///< false: it would take too much
  tagrid_status status = TAGRID_OK;
  std::vector<std::uint8_t> samples;
};

/// The grid of a brick in its last slice. The bits of broken bytes may be any.
void look_at_grid(Bytes file, tagrid_decoder* decoder, const tagrid_block& block) {
  if (tagrid_decoder_activity_memory(decoder, &block) > most_memory) return;
  tagrid_box box;
  const std::uint64_t* words = nullptr;
  const std::int64_t* edges = nullptr;
  std::size_t count = 0;
  if (tagrid_decoder_activity(decoder, &block, file.data() + block.range.offset,
                              static_cast<std::size_t>(block.range.bytes), &box, &words, &count) != TAGRID_OK)
    return;
  const std::vector<std::uint64_t> active(words, words + count);
  claim(tagrid_decoder_edges(decoder, block.number, active.data(), active.size(), 2, block.box.high[2] - 1,
                             &edges, &count) == TAGRID_OK,
        "what was decoded has edges");
}

Answer samples_of(Bytes file, tagrid_blocks* blocks, const tagrid_box& box, std::size_t size) {
  Answer answer;
  std::vector<tagrid_block> found(most_bricks);
  std::size_t count = 0;
  answer.status = with_bytes(
      file, blocks, [&] { return tagrid_blocks_plan(blocks, &box, 0, found.data(), found.size(), &count); });
  answer.is_known = true;
  if (answer.status != TAGRID_OK) return answer;
  answer.is_known = count < most_bricks;
  std::int64_t shape[3];
  for (int axis = 0; axis < 3; ++axis) shape[axis] = box.high[axis] - box.low[axis];
  answer.samples.resize(static_cast<std::size_t>(shape[0] * shape[1] * shape[2]) * size);
  const Decoder decoder(blocks);
  for (const tagrid_block& block :
       std::vector<tagrid_block>(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count))) {
    claim(block.range.offset <= file.size() && block.range.bytes <= file.size() - block.range.offset,
          "all blocks are in the file");
    if (tagrid_decoder_memory(decoder.handle, &block) > most_memory) answer.is_known = false;
    if (!answer.is_known) return answer;
    const void* samples = nullptr;
    std::size_t bytes = 0;
    answer.status = tagrid_decoder_decode(decoder.handle, &block, file.data() + block.range.offset,
                                          static_cast<std::size_t>(block.range.bytes), &samples, &bytes);
    if (answer.status != TAGRID_OK) return answer;
    const std::int64_t nx = block.box.high[0] - block.box.low[0], ny = block.box.high[1] - block.box.low[1];
    claim(bytes >= static_cast<std::size_t>(nx * ny * block.slices) * size,
          "a brick has all slices that are needed");
    for (std::int64_t z = std::max(block.box.low[2], box.low[2]);
         z < std::min(block.box.high[2], box.high[2]); ++z)
      for (std::int64_t y = std::max(block.box.low[1], box.low[1]);
           y < std::min(block.box.high[1], box.high[1]); ++y) {
        const std::int64_t x = std::max(block.box.low[0], box.low[0]),
                           end = std::min(block.box.high[0], box.high[0]),
                           to = ((z - box.low[2]) * shape[1] + y - box.low[1]) * shape[0] + x - box.low[0],
                           at = ((z - block.box.low[2]) * ny + y - block.box.low[1]) * nx + x -
                                block.box.low[0];
        std::memcpy(answer.samples.data() + static_cast<std::size_t>(to) * size,
                    static_cast<const std::uint8_t*>(samples) + static_cast<std::size_t>(at) * size,
                    static_cast<std::size_t>(end - x) * size);
      }
    look_at_grid(file, decoder.handle, block);
  }
  return answer;
}

}  // namespace

void blocks(Bytes bytes) {
  if (bytes.size() < 6) return;
  const Bytes file = bytes.subspan(6);
  const Blocks blocks(file.size());
  const Reader reader(file);
  const tagrid_status opened =
      with_bytes(file, blocks.handle, [&] { return tagrid_blocks_open(blocks.handle); });
  claim(opened == reader.status, "a file is open for a caller that fetches if it is for a reader");
  if (opened != TAGRID_OK)
    return claim(opened == TAGRID_BROKEN_INPUT || opened == TAGRID_NEWER_FORMAT,
                 "what cannot be opened is broken, or needs a newer program");
  tagrid_info info;
  tagrid_info_init(&info);
  claim(tagrid_blocks_info(blocks.handle, &info) == TAGRID_OK, "an open file is described");
  tagrid_box box;
  std::size_t samples = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t n = info.dims[axis];
    box.low[axis] = bytes[static_cast<std::size_t>(axis)] * (n - 1) / 255;
    box.high[axis] =
        std::min<std::int64_t>(n, box.low[axis] + 1 + bytes[static_cast<std::size_t>(3 + axis)] % 64);
    samples *= static_cast<std::size_t>(box.high[axis] - box.low[axis]);
  }
  if (samples > most_samples) return;
  const std::size_t size = tagrid_sample_size(info.type);
  const Answer answer = samples_of(file, blocks.handle, box, size);
  if (!answer.is_known) return;
  std::vector<std::uint8_t> expected(samples * size);
  tagrid_call call;
  tagrid_call_init(&call);
  call.threads = 1;
  const tagrid_status read =
      tagrid_reader_read(reader.handle, &box, nullptr, info.type, expected.data(), nullptr, &call);
  claim(read == answer.status, "samples are decoded for a caller that fetches if they are for a reader");
  claim(read == TAGRID_OK || read == TAGRID_BROKEN_INPUT || read == TAGRID_NEWER_FORMAT,
        "what cannot be decoded is broken, or needs a newer program");
  claim(read != TAGRID_OK || expected == answer.samples, "both have the same samples");

  std::int64_t factors[TAGRID_MOST_OVERVIEWS];
  claim(tagrid_blocks_overviews(blocks.handle, factors) == TAGRID_OK, "overviews are listed");
  for (const std::int64_t* factor = factors; *factor != 0; ++factor) {
    tagrid_blocks* nested = nullptr;
    tagrid_reader* other = nullptr;
    const tagrid_status status = with_bytes(
        file, blocks.handle, [&] { return tagrid_blocks_overview(blocks.handle, *factor, &nested); });
    claim(tagrid_reader_overview(reader.handle, *factor, &other) == status, "both open the same overviews");
    claim((nested != nullptr) == (status == TAGRID_OK), "an overview is there if it is open");
    tagrid_reader_close(other);
    tagrid_blocks_close(nested);
  }
}

}  // namespace tagrid::fuzz
