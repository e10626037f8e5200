// The half of the library that reads without threads and files: see tagrid_blocks.h.
#include "io/tag/blocks.h"
#include "io/metadata/text.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <utility>

#include "io/tag/bricks.h"
#include "pipeline/library/answers.h"
#include "pipeline/library/given_bytes.h"
#include "pipeline/reading/region.h"
#include "stages/brick/codec.h"
#include "stages/mesh/plane_edges.h"

using namespace tagrid;
using namespace tagrid::library;

struct tagrid_blocks {
  std::shared_ptr<GivenBytes> given;         ///< the whole file
  std::shared_ptr<const ByteSource> source;  ///< the file, or the member that this is about
  std::uint64_t base = 0;                    ///< position of the source in the file
  std::unique_ptr<const TagBricks> file;     ///< null until it is open
  std::vector<std::byte> header;
  SharedMessage message;
};

struct tagrid_decoder {
  CodingParameters parameters;
  bool is_open = false;
  DecodedBrick brick;
  std::vector<std::int64_t> edges;
  SharedMessage message;
};

namespace {

// Pages that one call asks for at once.
constexpr std::size_t most_pages_at_once = 64;
// Of the header, so many bytes are asked for before its size is known.
constexpr std::uint64_t first_bytes = 4096;
// What a call takes besides samples and copies of blocks: messages and small tables.
constexpr std::uint64_t small_things = 1 << 16;

template <class Handle, class Work>
tagrid_status answer(Handle& handle, Work work) noexcept {
  std::string message;
  tagrid_status status = TAGRID_OUT_OF_MEMORY;
  try {
    work();
    return TAGRID_OK;
  } catch (const BytesAreMissing&) {
    return TAGRID_NEEDS_BYTES;
  } catch (...) {
    try {
      SortedError error = sorted_error(std::current_exception());
      status = status_of(error);
      message = status == TAGRID_OUT_OF_MEMORY ? "out of memory" : std::move(error.message);
    } catch (...) {
      // There is no memory for the message.
      message.clear();
    }
  }
  handle.message.set(std::move(message));
  return status;
}

// Does the work of a call that may lack bytes.
template <class Work>
tagrid_status read_given_bytes(tagrid_blocks* blocks, Work work) noexcept {
  if (blocks == nullptr) return TAGRID_INVALID_ARGUMENT;
  blocks->given->begin();
  const tagrid_status status = answer(*blocks, work);
  if (status != TAGRID_NEEDS_BYTES) blocks->given->forget();
  return status;
}

template <class Work>
tagrid_status read_open(tagrid_blocks* blocks, Work work) noexcept {
  return read_given_bytes(blocks, [&] {
    require(blocks->file != nullptr, "the file is not open");
    work(*blocks->file);
  });
}

// What opening a source surely needs is asked for at once.
void expect_both_ends(const GivenBytes& given, std::uint64_t base, std::uint64_t size) {
  const std::uint64_t beginning = std::min(size, first_bytes), end = std::min(size, largest_end);
  const bool has_beginning = given.has(base, beginning), has_end = given.has(base + size - end, end);
  if (!has_beginning || !has_end) throw BytesAreMissing();
}

void open(tagrid_blocks& blocks) {
  expect_both_ends(*blocks.given, blocks.base, blocks.source->size());
  auto file = std::make_unique<const TagBricks>(blocks.source);
  blocks.header = bytes_at(*blocks.source, 0, file->sizes().header);
  blocks.file = std::move(file);
}

// Opens a file in the whole file, which is `base` bytes from its beginning.
void open_inner(const tagrid_blocks& outer, std::shared_ptr<const ByteSource> source, std::uint64_t base,
                tagrid_blocks** result) {
  auto inner = std::make_unique<tagrid_blocks>();
  inner->given = outer.given;
  inner->source = std::move(source);
  inner->base = base;
  open(*inner);
  *result = inner.release();
}

void open_nested(const tagrid_blocks& outer, const Member& member, tagrid_blocks** result) {
  const std::uint64_t base = outer.base + member.content();
  expect_both_ends(*outer.given, base, member.length);
  outer.file->nested(member);  // checks that it is one of this file
  open_inner(outer, outer.file->bytes_of(member), base, result);
}

// The bricks along each axis that hold samples of a box of lattice points.
Box bricks_with(const Box& points, const BrickGrid& bricks) {
  Box positions;
  for (int axis = 0; axis < 3; ++axis) {
    positions.low[axis] = bricks.owner(points.low[axis]);
    positions.high[axis] = bricks.owner(points.high[axis]);
  }
  return positions;
}

tagrid_block described(const tagrid_blocks& blocks, const Region& region, std::int64_t number) {
  const TagBricks& file = *blocks.file;
  const BrickGrid bricks = file.parameters().bricks();
  const Box owned = bricks.owned_box(bricks.position(number));
  tagrid_block block = {};
  block.number = number;
  block.box = half_open(bricks.domain.samples_at(owned));
  const TagBricks::Block at = file.block(number);
  block.range = {blocks.base + at.start - 8, at.bytes + 8};
  block.activity_bytes = at.activity;
  block.slices = slices_until(region, owned);
  return block;
}

bool has_brick(const CodingParameters& parameters, std::int64_t number) {
  return number >= 0 && number < parameters.bricks().count();
}

std::uint64_t memory_of(const tagrid_decoder* decoder, const tagrid_block* block, Wanted wanted) {
  if (decoder == nullptr || block == nullptr || !decoder->is_open) return 0;
  const CodingParameters& parameters = decoder->parameters;
  if (!has_brick(parameters, block->number)) return 0;
  return working_bytes_of_decoding(parameters, parameters.bricks().position(block->number), wanted) +
         block->range.bytes + small_things;
}

// Decodes a block by `decode(code, parameters)`, which returns a status.
template <class Decode>
void decode_block(tagrid_decoder& decoder, const tagrid_block* block, const void* bytes, std::size_t count,
                  Decode decode) {
  const CodingParameters& parameters = decoder.parameters;
  require(decoder.is_open, "the decoder is not open");
  require(block != nullptr && has_brick(parameters, block->number), "there is no brick with this number");
  require(bytes != nullptr && count == block->range.bytes, "the bytes are not those of the block");
  BrickBytes code;
  Status status = parse_bound_block({static_cast<const std::byte*>(bytes), count}, parameters, block->number,
                                    block->activity_bytes, code);
  if (status.ok()) status = decode(BrickCodeView{code.activity, code.values}, parameters);
  if (status.ok()) return;
  decoder.brick = {};
  throw broken_input_of("brick " + std::to_string(block->number), status);
}

}  // namespace

tagrid_status tagrid_blocks_create(uint64_t file_bytes, tagrid_blocks** blocks) {
  if (blocks == nullptr) return TAGRID_INVALID_ARGUMENT;
  *blocks = nullptr;
  try {
    auto made = std::make_unique<tagrid_blocks>();
    made->given = std::make_shared<GivenBytes>(file_bytes);
    made->source = made->given;
    *blocks = made.release();
    return TAGRID_OK;
  } catch (...) {
    return TAGRID_OUT_OF_MEMORY;
  }
}

void tagrid_blocks_close(tagrid_blocks* blocks) { delete blocks; }

const char* tagrid_blocks_message(const tagrid_blocks* blocks) {
  return blocks == nullptr ? "there is no file" : blocks->message.get();
}

size_t tagrid_blocks_needs(const tagrid_blocks* blocks, const tagrid_range** ranges) {
  if (blocks == nullptr || ranges == nullptr) return 0;
  *ranges = blocks->given->missing().data();
  return blocks->given->missing().size();
}

tagrid_status tagrid_blocks_give(tagrid_blocks* blocks, uint64_t offset, const void* bytes, size_t count) {
  if (blocks == nullptr) return TAGRID_INVALID_ARGUMENT;
  return answer(*blocks, [&] {
    const std::uint64_t size = blocks->given->size();
    require(bytes != nullptr || count == 0, "there are no bytes");
    require(offset <= size && count <= size - offset, "the bytes are not within the file");
    blocks->given->give(offset, {static_cast<const std::byte*>(bytes), count});
  });
}

tagrid_status tagrid_blocks_open(tagrid_blocks* blocks) {
  return read_given_bytes(blocks, [&] {
    if (blocks->file == nullptr) open(*blocks);
  });
}

tagrid_status tagrid_blocks_info(tagrid_blocks* blocks, tagrid_info* info) {
  return read_open(blocks, [&](const TagBricks& file) {
    hand_over(info_of(file.header(), file.index(), file.sizes()), info, sizeof *info);
  });
}

const char* tagrid_blocks_metadata(const tagrid_blocks* blocks) {
  return blocks == nullptr || blocks->file == nullptr ? "" : text_of(blocks->file->header().metadata).c_str();
}

tagrid_status tagrid_blocks_overviews(tagrid_blocks* blocks, int64_t* factors) {
  return read_open(blocks, [&](const TagBricks& file) { list_overviews(file.index(), factors); });
}

tagrid_status tagrid_blocks_volumes(tagrid_blocks* blocks, int64_t* count) {
  return read_open(blocks, [&](const TagBricks& file) {
    require(count != nullptr, "there is no room for the number");
    *count = file.header().volumes;
  });
}

int tagrid_blocks_stores_grid(const tagrid_blocks* blocks) {
  return blocks != nullptr && blocks->file != nullptr && blocks->file->parameters().stores_activity();
}

const void* tagrid_blocks_header(const tagrid_blocks* blocks, size_t* bytes) {
  if (blocks == nullptr || bytes == nullptr || blocks->file == nullptr) return nullptr;
  *bytes = blocks->header.size();
  return blocks->header.data();
}

tagrid_status tagrid_blocks_overview(tagrid_blocks* blocks, int64_t factor, tagrid_blocks** overview) {
  if (overview == nullptr) return TAGRID_INVALID_ARGUMENT;
  *overview = nullptr;
  return read_open(blocks, [&](const TagBricks& file) {
    open_nested(*blocks, member_of_overview(file, factor), overview);
  });
}

tagrid_status tagrid_blocks_volume(tagrid_blocks* blocks, int64_t number, tagrid_blocks** volume) {
  if (volume == nullptr) return TAGRID_INVALID_ARGUMENT;
  *volume = nullptr;
  return read_open(blocks, [&](const TagBricks& file) {
    if (const Member* member = member_of_volume(file, number)) return open_nested(*blocks, *member, volume);
    open_inner(*blocks, blocks->source, blocks->base, volume);
  });
}

tagrid_status tagrid_blocks_plan(tagrid_blocks* blocks, const tagrid_box* box, int64_t first,
                                 tagrid_block* found, size_t room, size_t* count) {
  return read_open(blocks, [&](const TagBricks& file) {
    require(box != nullptr && count != nullptr && (found != nullptr || room == 0) && first >= 0,
            "the box or the room for its bricks is missing");
    *count = 0;
    const CodingParameters& parameters = file.parameters();
    const BrickGrid bricks = parameters.bricks();
    const Region region{parameters.domain().points_of(box_of(*box, parameters.dims))};
    const Box positions = bricks_with(region.box, bricks);
    const Index3 size = positions.size();
    const std::int64_t all = positions.count();
    const auto wanted = std::min(static_cast<std::uint64_t>(all - std::min(first, all)), std::uint64_t{room});
    std::size_t missing = 0;
    std::uint64_t done = 0;
    for (; done < wanted && missing < most_pages_at_once; ++done) {
      const std::int64_t i = first + static_cast<std::int64_t>(done);
      const Index3 from_first = {i % size.x, i / size.x % size.y, i / (size.x * size.y)};
      const std::size_t before = blocks->given->missing().size();
      try {
        found[done] = described(*blocks, region, bricks.id(positions.low + from_first));
      } catch (const BytesAreMissing&) {
        // Other pages that are missing are asked for in the same round.
        missing += blocks->given->missing().size() - before;
      }
    }
    if (missing > 0) throw BytesAreMissing();
    *count = static_cast<std::size_t>(done);
  });
}

tagrid_status tagrid_decoder_open(const void* header, size_t bytes, tagrid_decoder** decoder) {
  if (decoder == nullptr) return TAGRID_INVALID_ARGUMENT;
  *decoder = new (std::nothrow) tagrid_decoder;
  if (*decoder == nullptr) return TAGRID_OUT_OF_MEMORY;
  return answer(**decoder, [&] {
    require(header != nullptr, "there is no header");
    TagHeader parsed;
    std::uint64_t checksum = 0;
    const std::span all(static_cast<const std::byte*>(header), bytes);
    if (Status status = parse_header(all, parsed, checksum); !status.ok())
      throw broken_input_of("the header", status);
    (*decoder)->parameters = parsed.parameters;
    (*decoder)->is_open = true;
  });
}

void tagrid_decoder_close(tagrid_decoder* decoder) { delete decoder; }

const char* tagrid_decoder_message(const tagrid_decoder* decoder) {
  return decoder == nullptr ? "there is no decoder" : decoder->message.get();
}

uint64_t tagrid_decoder_memory(const tagrid_decoder* decoder, const tagrid_block* block) {
  return memory_of(decoder, block, Wanted::samples);
}

uint64_t tagrid_decoder_activity_memory(const tagrid_decoder* decoder, const tagrid_block* block) {
  return memory_of(decoder, block, Wanted::samples_and_grid);
}

tagrid_status tagrid_decoder_decode(tagrid_decoder* decoder, const tagrid_block* block, const void* bytes,
                                    size_t count, const void** samples, size_t* sample_bytes) {
  if (decoder == nullptr || samples == nullptr || sample_bytes == nullptr) return TAGRID_INVALID_ARGUMENT;
  *samples = nullptr;
  *sample_bytes = 0;
  decoder->brick = {};
  return answer(*decoder, [&] {
    decode_block(*decoder, block, bytes, count, [&](BrickCodeView code, const CodingParameters& parameters) {
      const BrickGrid bricks = parameters.bricks();
      const std::int64_t all = bricks.owned_box(bricks.position(block->number)).size().z;
      const std::int64_t slices = block->slices >= 1 && block->slices < all ? block->slices : all_slices;
      return decode_brick_samples(code, parameters, block->number, slices, decoder->brick);
    });
    *samples = decoder->brick.samples.data();
    *sample_bytes = decoder->brick.samples.size();
  });
}

tagrid_status tagrid_decoder_activity(tagrid_decoder* decoder, const tagrid_block* block, const void* bytes,
                                      size_t count, tagrid_box* box, const uint64_t** words,
                                      size_t* word_count) {
  if (decoder == nullptr || box == nullptr || words == nullptr || word_count == nullptr)
    return TAGRID_INVALID_ARGUMENT;
  *words = nullptr;
  *word_count = 0;
  decoder->brick = {};
  return answer(*decoder, [&] {
    decode_block(*decoder, block, bytes, count, [&](BrickCodeView code, const CodingParameters& parameters) {
      require(parameters.stores_activity(), "the file stores no grid: it is computed from decoded samples");
      return decode_brick(code, parameters, {block->number}, decoder->brick);
    });
    decoder->brick.samples = {};
    decoder->brick.points = {};
    const LatticeBits& active = decoder->brick.active;
    *box = half_open(decoder->parameters.domain().samples_at(active.box()));
    *words = active.words().data();
    *word_count = active.words().size();
  });
}

tagrid_status tagrid_decoder_edges(tagrid_decoder* decoder, int64_t number, const uint64_t* words,
                                   size_t word_count, int axis, int64_t slice, const int64_t** edges,
                                   size_t* edge_count) {
  if (decoder == nullptr || edges == nullptr || edge_count == nullptr) return TAGRID_INVALID_ARGUMENT;
  *edges = nullptr;
  *edge_count = 0;
  return answer(*decoder, [&] {
    const CodingParameters& parameters = decoder->parameters;
    require(decoder->is_open && has_brick(parameters, number), "there is no brick with this number");
    require(axis >= 0 && axis < 3, "the axes are 0, 1 and 2");
    const BrickGrid bricks = parameters.bricks();
    const Box owned = bricks.owned_box(bricks.position(number));
    const Index3 first = bricks.domain.first();
    const std::int64_t at = slice <= owned.high[axis] ? slice + first[axis] : slice;
    require(owned.low[axis] <= at && at <= owned.high[axis], "the brick holds no samples of this slice");
    LatticeBits active(bricks.closed_box(bricks.position(number)));
    require(words != nullptr && word_count == active.words().size(), "the activity is not that of the brick");
    std::copy_n(words, word_count, active.words().begin());
    decoder->edges.clear();
    const int across = axis == 0 ? 1 : 0, down = axis == 2 ? 1 : 2;
    const std::vector<PlaneEdge> found = edges_in_plane(active, parameters.cube_size, axis, at);
    decoder->edges.reserve(4 * found.size());
    for (const PlaneEdge& edge : found)
      for (const PlacePlane& place : {edge.from, edge.to}) {
        decoder->edges.push_back(place.across - first[across]);
        decoder->edges.push_back(place.down - first[down]);
      }
    *edges = decoder->edges.data();
    *edge_count = decoder->edges.size() / 4;
  });
}
