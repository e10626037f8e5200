#include "io/tag/file.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"

namespace tagrid {
TagWriter::TagWriter(ByteSink& out, const TagHeader& header)
    : out_(out),
      parameters_(header.parameters),
      envelope_(last_checksum_, [this](const std::vector<std::byte>& block) {
        out_.write(block);
        position_ += block.size();
        envelope_size_ += block.size();
      }) {
  const std::vector<std::byte> bytes = serialize_header(header);
  header_checksum_ = load_little_endian<std::uint64_t>(bytes.data() + bytes.size() - 8);
  last_checksum_ = header_checksum_;
  out_.write(bytes);
  position_ = header_size_ = bytes.size();
}

void TagWriter::write_brick(const BrickBytes& brick, const Statistics& statistics) {
  assert(brick.id == static_cast<std::int64_t>(index_.bricks.size()));
  last_checksum_ = write_block(out_, parameters_, brick, last_checksum_);
  position_ += block_frame_size + brick.activity.size() + brick.values.size();
  index_.add(brick.activity.size(), brick.values.size(), statistics);
}

void TagWriter::finish() {
  envelope_.finish();
  const std::vector<std::byte> end =
      file_end(parameters_, index_, position_, last_checksum_, header_checksum_);
  out_.write(end);
  position_ += end.size();
}

TagReader::TagReader(const std::string& path) : TagReader(std::make_unique<FileBytes>(path)) {}

TagReader::TagReader(std::unique_ptr<ByteStream> stream) : bytes_(std::move(stream)) {
  std::vector<std::byte> bytes(tag_preamble_size);
  bytes.resize(bytes_->read(bytes.data(), bytes.size()));
  header_size_ = header_size_of(name(), bytes);
  std::vector<std::byte> whole;
  read_growing(whole, bytes, header_size_ - bytes.size(), "the header");
  header_ = header_of(name(), whole, header_checksum_);
  last_checksum_ = header_checksum_;
  const auto bricks = static_cast<std::uint64_t>(parameters().bricks().count());
  if (bytes_->size() && bricks > (*bytes_->size() - header_size_) / block_frame_size)
    throw BrokenInput(name() + ": the file is too short for the bricks of its volume; it is truncated");
}

std::string TagReader::place() const {
  return next_brick_ < parameters().bricks().count() ? "brick " + std::to_string(next_brick_) : "the index";
}

void TagReader::fail(const std::string& what) const {
  throw broken_part(name(), place(), bytes_->position(), what);
}

void TagReader::read_exactly(std::byte* out, std::size_t size, const char* what) {
  if (bytes_->read(out, size) != size) fail(std::string("the file ends in ") + what + "; it is truncated");
}

// Reads in steps, so that a false size takes no memory.
void TagReader::read_growing(std::vector<std::byte>& out, std::span<const std::byte> before,
                             std::uint64_t size, const char* what) {
  constexpr std::uint64_t step = 1 << 20;
  out.assign(before.begin(), before.end());
  const std::uint64_t all = before.size() + size;
  while (out.size() < all) {
    const std::size_t have = out.size(), more = std::min(step, all - have);
    out.resize(have + more);
    read_exactly(out.data() + have, more, what);
  }
}

// The next block is bound to a brick. It is read before the brick is handed out, and shows that the brick
// belongs to this file.
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
    read_index_section(read_envelope());
  }
  return true;
}

void TagReader::read_frame(BrickBytes& brick) {
  std::array<std::byte, 4> length_bytes;
  read_exactly(length_bytes.data(), length_bytes.size(), "a brick");
  const auto length = load_little_endian<std::uint32_t>(length_bytes.data());
  if (length < 4 || length > largest_body(parameters(), next_brick_)) fail("an impossible size");
  read_growing(block_, length_bytes, std::uint64_t{length} + 8, "a brick");
  if (Status status = parse_block(block_, parameters(), next_brick_, last_checksum_, brick); !status.ok())
    fail(status.what());
  ++next_brick_;
}

TagReader::Marker TagReader::read_envelope() {
  const std::uint64_t start = bytes_->position();
  for (;;) {
    Marker marker;
    read_exactly(marker.data(), marker.size(), "the index");
    if (load_little_endian<std::uint32_t>(marker.data()) != envelope_marker) {
      envelope_size_ = bytes_->position() - marker.size() - start;
      return marker;
    }
    std::array<std::byte, envelope_head_size> head;
    std::ranges::copy(marker, head.begin());
    read_exactly(head.data() + marker.size(), head.size() - marker.size(), "the envelope");
    std::uint64_t rest = 0;
    const auto require = [&](const Status& status) {
      if (!status.ok()) throw broken_part(name(), "the envelope", bytes_->position(), status.what());
    };
    require(parse_envelope_head(head, rest));
    read_growing(block_, head, rest, "the envelope");
    const bool is_first = bytes_->position() - start == block_.size();
    require(parse_envelope_block(block_, last_checksum_, is_first ? &beginning_of_envelope_ : nullptr));
  }
}

void TagReader::read_index_section(const Marker& marker) {
  const FileEnd end = {parameters(), header_size_, header_checksum_, bytes_->position() - marker.size(),
                       last_checksum_};
  std::array<std::byte, index_head_size> head;
  std::ranges::copy(marker, head.begin());
  read_exactly(head.data() + marker.size(), head.size() - marker.size(), "the index");
  std::uint64_t rest = 0;
  if (Status status = end.parse_head(head, rest); !status.ok()) fail(status.what());
  std::vector<std::byte> section;
  read_growing(section, head, rest, "the index");
  std::uint64_t envelope = 0;
  if (Status status = end.parse(section, index_, envelope); !status.ok()) fail(status.what());
  if (envelope != envelope_size_) fail("the sizes of the bricks do not add up to the size of the file");
  std::byte extra;
  if (bytes_->read(&extra, 1) != 0) throw BrokenInput(name() + ": " + bytes_follow);
  next_brick_ = parameters().bricks().count();
  file_size_ = end.start + section.size();
}

BrickStream TagReader::bricks() {
  return {name(), [this](BrickBytes& brick) { return read_brick(brick); }};
}

void TagReader::read_to_end() {
  BrickBytes brick;
  while (read_brick(brick)) {
  }
}

}  // namespace tagrid
