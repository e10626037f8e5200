#include "io/tag/file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <stdexcept>
#include <utility>

#include "io/bytes/byte_fields.h"
#include "io/bytes/checksum.h"
#include "io/bytes/zstd_bytes.h"
#include "io/files/errors.h"
#include "io/nrrd/geometry.h"
#include "io/nrrd/header.h"
#include "io/vdb/reader.h"
#include "io/volume/volume_info.h"
#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

constexpr std::size_t footer_size = 8 + 8 + end_magic.size();

}  // namespace

TagWriter::TagWriter(OutputFile& out, const TagHeader& header) : out_(out), parameters_(header.parameters) {
  const std::vector<std::byte> bytes = serialize_header(header);
  header_checksum_ = load_little_endian<std::uint64_t>(bytes.data() + bytes.size() - 8);
  last_checksum_ = header_checksum_;
  out_.write(bytes);
}

void TagWriter::write_brick(const BrickBytes& brick, const Statistics& statistics) {
  assert(brick.id == static_cast<std::int64_t>(index_.bricks.size()));
  const std::vector<std::byte> head = block_head(parameters_, brick);
  last_checksum_ = chained_checksum(own_checksum(head, brick), last_checksum_);
  write_block(out_, head, brick, last_checksum_);
  index_.add(brick.activity.size(), brick.values.size(), statistics);
}

void TagWriter::finish() {
  out_.write(file_end(parameters_, index_, out_.position(), last_checksum_, header_checksum_));
}

namespace {

/// What a file is that should have been encoded before.
std::string_view kind_of_volume(FileBytes& file) {
  if (begins_nrrd(file.peek(9))) return "an NRRD volume";
  return begins_vdb(file.peek(8)) ? "an OpenVDB file" : "";
}

}  // namespace

TagReader::TagReader(const std::string& path) : bytes_(path) {
  if (const std::string_view volume = kind_of_volume(bytes_); !volume.empty())
    throw BrokenInput(fmt::format("{}: this is not a .tag file, but {}; encode it first, with tagrid encode",
                                  name(), volume));
  if (bytes_.peek(1).empty()) throw BrokenInput(name() + ": this is not a .tag file: it is empty");
  std::vector<std::byte> bytes(tag_preamble_size);
  const std::size_t got = bytes_.read(bytes.data(), bytes.size());
  if (got < bytes.size())
    throw BrokenInput(name() + ": this is not a .tag file: it has only " + std::to_string(got) + " bytes");
  std::size_t size = 0;
  if (Status status = parse_preamble(bytes, size); !status.ok())
    throw BrokenInput(name() + ": " + status.what());
  std::vector<std::byte> rest;
  read_growing(rest, size - bytes.size(), "the header");
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  if (Status status = parse_header(bytes, header_, header_checksum_); !status.ok())
    throw BrokenInput(name() + ": " + status.what());
  try {
    geometry_of(header_.nrrd_fields);
  } catch (const BrokenInput& broken) {
    throw BrokenInput(name() + ": the source's fields in the header: " + broken.what());
  }
  header_size_ = size;
  last_checksum_ = header_checksum_;
  const auto bricks = static_cast<std::uint64_t>(parameters().bricks().count());
  if (bytes_.size() && bricks > (*bytes_.size() - header_size_) / block_frame_size)
    throw BrokenInput(name() + ": the file is too short for the bricks of its volume; it is truncated");
}

std::string TagReader::place() const {
  return next_brick_ < parameters().bricks().count() ? "brick " + std::to_string(next_brick_) : "the index";
}

void TagReader::fail(const std::string& what) const {
  throw BrokenInput(name() + ": " + place() + ", before byte " + std::to_string(bytes_.position()) + ": " +
                    what);
}

void TagReader::read_exactly(std::byte* out, std::size_t size, const char* what) {
  if (bytes_.read(out, size) != size) fail(std::string("the file ends in ") + what + "; it is truncated");
}

// In steps, so that a size that the file does not have takes no memory.
void TagReader::read_growing(std::vector<std::byte>& out, std::uint64_t size, const char* what) {
  constexpr std::uint64_t step = 1 << 20;
  out.clear();
  while (out.size() < size) {
    const std::size_t have = out.size(), more = std::min(step, size - have);
    out.resize(have + more);
    read_exactly(out.data() + have, more, what);
  }
}

// What follows a brick is bound to it: read before the brick is handed out, it shows that the brick is of
// this file.
bool TagReader::read_brick(BrickBytes& brick) {
  const std::int64_t count = parameters().bricks().count();
  if (starting_) read_frame(ahead_);
  starting_ = false;
  if (ahead_.id < 0) return false;
  brick = std::move(ahead_);
  ahead_ = {};
  if (next_brick_ < count) {
    read_frame(ahead_);
  } else {
    ahead_.id = -1;
    read_index_section();
  }
  return true;
}

void TagReader::read_frame(BrickBytes& brick) {
  std::array<std::byte, 4> length_bytes;
  read_exactly(length_bytes.data(), length_bytes.size(), "a brick");
  const auto length = load_little_endian<std::uint32_t>(length_bytes.data());
  if (length < 12 || length > largest_body(parameters(), next_brick_)) fail("an impossible size");
  read_growing(body_, std::uint64_t{length} + 8, "a brick");
  const std::span<const std::byte> body(body_.data(), length);
  FieldReader reader(body);
  const auto id = reader.get<std::uint64_t>();
  const auto activity_size = reader.get<std::uint32_t>();
  const auto checksum = load_little_endian<std::uint64_t>(body_.data() + length);
  if (!checksums_agree(checksum, chained_checksum(checksum_of({length_bytes, body}), last_checksum_)))
    fail("the checksum does not fit: the brick is damaged, or it or the one before is of another file");
  if (id != static_cast<std::uint64_t>(next_brick_)) fail("brick " + std::to_string(id) + " is in its place");
  const auto activity = reader.get_bytes(activity_size);
  if (reader.overrun()) fail("the activity is larger than the brick");
  const auto values = reader.get_bytes(reader.left());
  const auto copy = [](std::span<const std::byte> from, std::vector<std::uint8_t>& to) {
    const auto* first = reinterpret_cast<const std::uint8_t*>(from.data());
    to.assign(first, first + from.size());
  };
  last_checksum_ = checksum;
  brick.id = next_brick_++;
  copy(activity, brick.activity);
  copy(values, brick.values);
}

void TagReader::read_index_section() {
  const std::uint64_t start = bytes_.position();
  std::vector<std::byte> head(4 + 8 + 8);
  read_exactly(head.data(), head.size(), "the index");
  FieldReader reader(head);
  const auto marker = reader.get<std::uint32_t>();
  const auto size = reader.get<std::uint64_t>(), packed_size = reader.get<std::uint64_t>();
  const auto count = static_cast<std::uint64_t>(parameters().bricks().count());
  const IndexForm form = index_form(parameters());
  if (marker != 0) fail("there are more bricks than the volume has");
  if (size != index_size(count, form) || packed_size > size + size / 128 + 1024)
    fail("the index has an impossible size");
  if (count > (start - header_size_) / block_frame_size) fail("the file is too short for as many bricks");
  std::vector<std::byte> packed, fields, tail;
  read_growing(packed, packed_size, "the index");
  read_growing(tail, 8 + footer_size, "the footer");
  if (!checksums_agree(load_little_endian<std::uint64_t>(tail.data()),
                       chained_checksum(checksum_of({head, packed}), last_checksum_)))
    fail("the checksum does not fit: the index is damaged, or the last brick is of another file");
  if (load_little_endian<std::uint64_t>(tail.data() + 8) != start ||
      !checksums_agree(load_little_endian<std::uint64_t>(tail.data() + 16), header_checksum_) ||
      !std::equal(tail.begin() + 24, tail.end(), std::as_bytes(std::span(end_magic)).begin()))
    fail("the footer is damaged");
  std::byte extra;
  if (bytes_.read(&extra, 1) != 0) throw BrokenInput(name() + ": bytes follow after the end of the file");
  if (Status status = zstd_decompress(packed, size, fields); !status.ok()) fail(status.what());
  if (Status status = parse_index(fields, count, form, index_); !status.ok()) fail(status.what());
  next_brick_ = parameters().bricks().count();
  std::uint64_t bricks_size = count * block_frame_size;
  for (const IndexEntry& brick : index_.bricks)
    bricks_size += std::uint64_t{brick.activity_bytes} + brick.value_bytes;
  if (header_size_ + bricks_size != start) fail("the sizes of the bricks do not sum to the file's");
  file_size_ = start + head.size() + packed_size + tail.size();
}

// The frame before it ends with its checksum, which is the seed of the next one's; so does the header.
void TagReader::seek_brick(std::int64_t brick) {
  assert(can_seek() && index_.bricks.size() == static_cast<std::uint64_t>(parameters().bricks().count()));
  std::uint64_t start = header_size_;
  for (std::int64_t i = 0; i < brick; ++i) {
    const IndexEntry& entry = index_.bricks[static_cast<std::size_t>(i)];
    start += block_frame_size + entry.activity_bytes + entry.value_bytes;
  }
  std::array<std::byte, 8> before;
  next_brick_ = brick;
  bytes_.seek(start - before.size());
  read_exactly(before.data(), before.size(), "a brick");
  last_checksum_ = load_little_endian<std::uint64_t>(before.data());
  starting_ = true;
}

void TagReader::read_index() {
  if (const auto size = bytes_.size()) {
    if (*size < header_size_ + footer_size) fail("the file ends before its index; it is truncated");
    std::vector<std::byte> footer;
    bytes_.seek(*size - footer_size);
    read_growing(footer, footer_size, "the footer");
    const auto start = load_little_endian<std::uint64_t>(footer.data());
    if (!std::equal(footer.begin() + 16, footer.end(), std::as_bytes(std::span(end_magic)).begin()) ||
        start < header_size_ || start > *size - footer_size)
      throw BrokenInput(name() + ": the file has no footer: it is truncated, damaged or was never finished");
    std::vector<std::byte> before;
    bytes_.seek(start - 8);
    read_growing(before, 8, "the last brick");
    last_checksum_ = load_little_endian<std::uint64_t>(before.data());
    next_brick_ = parameters().bricks().count();
    read_index_section();
    return;
  }
  BrickBytes brick;
  while (read_brick(brick)) {
  }
}

TagSizes TagReader::sizes() const {
  TagSizes sizes;
  sizes.file = file_size_;
  sizes.header = header_size_;
  for (const IndexEntry& brick : index_.bricks) {
    sizes.activity += brick.activity_bytes;
    sizes.values += brick.value_bytes;
  }
  sizes.index = sizes.file - sizes.header - sizes.activity - sizes.values;
  return sizes;
}

}  // namespace tagrid
