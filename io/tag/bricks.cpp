#include "io/tag/bricks.h"

#include <algorithm>
#include <cassert>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/tag/file.h"

namespace tagrid {

IndexedTag::IndexedTag(std::shared_ptr<const ByteSource> source)
    : source_(without_parity(source)), parity_(parity_at_end(*source)) {
  const std::uint64_t size = source_->size();
  header_size_ = header_size_of(name(), bytes_at(0, std::min<std::uint64_t>(size, tag_preamble_size)));
  if (header_size_ > size)
    throw broken_part(name(), "the header", size,
                      "the file ends in it; it is truncated, and nothing can be read");
  header_ = header_of(name(), bytes_at(0, header_size_), header_checksum_);
}

// A false size takes no memory: it is compared with the size of the file first.
std::vector<std::byte> IndexedTag::bytes_at(std::uint64_t position, std::uint64_t size) const {
  if (position > source_->size() || size > source_->size() - position)
    throw BrokenInput(name() + ": before byte " + std::to_string(position + size) +
                      ": the file ends; it is truncated");
  std::vector<std::byte> bytes(memory_size(size));
  source_->read_at(position, bytes);
  return bytes;
}

std::uint64_t IndexedTag::checksum_before(std::uint64_t position) const {
  return load_little_endian<std::uint64_t>(bytes_at(position - 8, 8).data());
}

IndexedTag::End IndexedTag::read_end(std::optional<std::uint64_t> last_checksum) const {
  const std::uint64_t size = source_->size();
  if (size < header_size_ + footer_size)
    throw broken_part(name(), "the index", size, "the file ends before its index; it is truncated");
  End end;
  if (Status status = find_file_end(bytes_at(size - footer_size, footer_size), end.start);
      !status.ok() || end.start < header_size_ || end.start > size - footer_size)
    throw BrokenInput(name() + ": " + no_footer);
  const FileEnd facts = {parameters(), header_size_, header_checksum_, end.start,
                         last_checksum ? *last_checksum : checksum_before(end.start)};
  std::uint64_t rest = 0;
  const std::uint64_t present = size - end.start;
  if (present < index_head_size)
    throw broken_part(name(), "the index", size, "the file ends in it; it is truncated");
  if (Status status = facts.parse_head(bytes_at(end.start, index_head_size), rest); !status.ok())
    throw broken_part(name(), "the index", end.start + index_head_size, status.what());
  if (rest < present - index_head_size) throw BrokenInput(name() + ": " + bytes_follow);
  if (rest > present - index_head_size)
    throw broken_part(name(), "the index", size, "the file ends in it; it is truncated");
  if (Status status = facts.parse(bytes_at(end.start, present), end.index, end.envelope_size); !status.ok())
    throw broken_part(name(), "the index", size, status.what());
  return end;
}

TagBricks::TagBricks(std::shared_ptr<const ByteSource> source)
    : IndexedTag(std::move(source)), end_(read_end()) {
  starts_.reserve(index().bricks.size() + 1);
  starts_.push_back(header_size_);
  for (const IndexEntry& brick : index().bricks)
    starts_.push_back(starts_.back() + block_frame_size + brick.activity_bytes + brick.value_bytes);
}

BrickBytes TagBricks::read(std::int64_t brick) const {
  assert(brick >= 0 && brick < count());
  // Before anything is read: a false size takes no memory.
  if (block_bytes(brick) > 4 + largest_body(parameters(), brick) + 8)
    throw broken_part(name(), "brick " + std::to_string(brick), start(brick), "an impossible size");
  const std::vector<std::byte> bytes = bytes_at(start(brick) - 8, block_bytes(brick) + 8);
  auto checksum = load_little_endian<std::uint64_t>(bytes.data());
  BrickBytes result;
  if (Status status = parse_block(std::span(bytes).subspan(8), parameters(), brick, checksum, result);
      !status.ok())
    throw broken_part(name(), "brick " + std::to_string(brick), start(brick + 1), status.what());
  return result;
}

std::function<bool(std::vector<std::byte>&)> TagBricks::envelope() const {
  const std::uint64_t start = starts_.back(), end = start + end_.envelope_size;
  return [this, position = start, end,
          checksum = checksum_before(start)](std::vector<std::byte>& content) mutable {
    if (position == end) return false;
    const auto require = [&](const Status& status) {
      if (!status.ok()) throw broken_part(name(), "the envelope", position, status.what());
    };
    if (end - position < envelope_head_size) require(Status::broken("an impossible size"));
    std::uint64_t rest = 0;
    require(parse_envelope_head(bytes_at(position, envelope_head_size), rest));
    if (rest > end - position - envelope_head_size) require(Status::broken("an impossible size"));
    require(parse_envelope_block(bytes_at(position, envelope_head_size + rest), checksum, &content));
    position += envelope_head_size + rest;
    return true;
  };
}

std::vector<std::byte> TagBricks::beginning_of_envelope() const {
  std::vector<std::byte> content;
  envelope()(content);
  return content;
}

BrickStream TagBricks::bricks_from(std::int64_t first) const {
  return {name(), [this, id = first](BrickBytes& brick) mutable {
            if (id == count()) return false;
            brick = read(id++);
            return true;
          }};
}

TagSummary summary_of(const std::string& path) {
  if (is_regular_input(path)) {
    const TagBricks file(std::make_shared<FileSource>(path));
    return {file.header(), file.index(), file.sizes(), file.beginning_of_envelope(), file.parity()};
  }
  TagReader reader(path);
  reader.read_to_end();
  return {reader.header(), reader.index(), reader.sizes(), reader.beginning_of_envelope(), reader.parity()};
}

}  // namespace tagrid
