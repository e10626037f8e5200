#include "io/tag/bricks.h"

#include <algorithm>
#include <cassert>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"

namespace tagrid {

IndexedTag::IndexedTag(std::shared_ptr<const ByteSource> source) : source_(std::move(source)) {
  const std::uint64_t size = source_->size();
  // Usually all of the header, in one read.
  constexpr std::uint64_t enough = 4096;
  std::vector<std::byte> bytes = bytes_at(0, std::min(size, enough));
  header_size_ =
      header_size_of(name(), std::span(bytes).first(std::min<std::size_t>(bytes.size(), tag_preamble_size)));
  if (header_size_ > size)
    throw broken_part(name(), "the header", size,
                      "the file ends in it; it is truncated, and nothing can be read");
  if (header_size_ > bytes.size()) bytes = bytes_at(0, header_size_);
  header_ =
      header_of(name(), std::span(bytes).first(static_cast<std::size_t>(header_size_)), header_checksum_);
}

std::uint64_t IndexedTag::checksum_before(std::uint64_t position) const {
  return load_little_endian<std::uint64_t>(bytes_at(position - 8, 8).data());
}

IndexedTag::End IndexedTag::read_end() {
  // The header ends in a checksum, which is the one before the directory if there is nothing between.
  const auto first_of_end = [&](std::uint64_t size) {
    return std::max(header_size_ - 8, size - std::min(size, largest_end));
  };
  std::uint64_t size = source_->size(), first = first_of_end(size);
  std::vector<std::byte> bytes = bytes_at(first, size - first);
  if (const auto parity = parity_at_end(size, bytes)) {
    parity_ = parity;
    source_ = beginning_of(source_, size = parity->file_size);
    first = first_of_end(size);
    bytes = bytes_at(first, size - std::min(first, size));
  }
  if (size < header_size_ + footer_size)
    throw broken_part(name(), "the index", size, "the file ends before its index; it is truncated");
  const std::span all(bytes);
  End end;
  if (Status status = find_file_end(all.last(footer_size), end.start);
      !status.ok() || end.start < header_size_ || end.start > size - footer_size)
    throw BrokenInput(name() + ": " + no_footer);
  if (end.start < first + 8) throw broken_part(name(), "the index", size, "the index has an impossible size");
  const auto from_start = all.subspan(static_cast<std::size_t>(end.start - first));
  const auto stored = load_little_endian<std::uint64_t>(from_start.data() - 8);
  const FileEnd facts = {parameters(), header_size_, header_checksum_, end.start, stored, header_.volumes};
  std::uint64_t rest = 0;
  const std::uint64_t present = size - end.start;
  if (present < index_head_size)
    throw broken_part(name(), "the index", size, "the file ends in it; it is truncated");
  if (Status status = facts.parse_head(from_start.first(index_head_size), rest); !status.ok())
    throw broken_part(name(), "the index", end.start + index_head_size, status.what());
  if (rest < present - index_head_size) throw BrokenInput(name() + ": " + bytes_follow);
  if (rest > present - index_head_size)
    throw broken_part(name(), "the index", size, "the file ends in it; it is truncated");
  if (Status status = facts.parse(from_start, end.index, end.envelope_size); !status.ok())
    throw broken_part(name(), "the index", size, status);
  return end;
}

bool IndexedTag::is_bound(const Member& member) const {
  Member in_file;
  if (!parse_member_head(bytes_at(member.offset, member_head_size), member.offset, in_file).ok() ||
      in_file != member)
    return false;
  MemberChecksum own(member);
  for (std::uint64_t done = 0; done < member.length;) {
    const std::uint64_t part = std::min<std::uint64_t>(member.length - done, 1 << 20);
    own.add(bytes_at(member.content() + done, part));
    done += part;
  }
  return checksums_agree(checksum_before(member.end()), own.chained(checksum_before(member.offset)));
}

std::shared_ptr<const ByteSource> IndexedTag::bytes_of(const Member& member) const {
  return std::make_shared<PartOfSource>(source_, member.content(), member.length,
                                        name() + ": " + member.name());
}

TagBricks::TagBricks(std::shared_ptr<const ByteSource> source)
    : IndexedTag(std::move(source)),
      end_(read_end()),
      pages_(source_, header_size_, parameters().bricks().count(), end_.index.pages) {}

TagBricks::Place TagBricks::place(std::int64_t brick) const {
  assert(brick >= 0 && brick < count());
  const std::int64_t page = pages_.layout().page_of(brick);
  return {pages_.sizes(page), static_cast<std::size_t>(brick - pages_.layout().first(page))};
}

std::uint64_t TagBricks::start(std::int64_t brick) const { return place(brick).start(); }
std::uint64_t TagBricks::block_bytes(std::int64_t brick) const { return place(brick).bytes(); }

TagBricks::Block TagBricks::block(std::int64_t brick) const {
  const Place at = place(brick);
  const Block block = {at.start(), at.bytes(), at.sizes->activity[at.number]};
  if (block.bytes > 4 + largest_body(parameters(), brick) + 8)
    throw broken_part(name(), "brick " + std::to_string(brick), block.start, "an impossible size");
  return block;
}

IndexEntry TagBricks::entry(std::int64_t brick) const {
  const Place at = place(brick);
  IndexEntry entry = (*pages_.statistics(pages_.layout().page_of(brick)))[at.number];
  entry.activity_bytes = at.sizes->activity[at.number];
  entry.value_bytes = static_cast<std::uint32_t>(at.bytes() - block_frame_size - entry.activity_bytes);
  return entry;
}

void TagBricks::will_read(std::span<const std::int64_t> bricks) const {
  if (!source_->waits()) return;
  std::vector<ByteRange> ranges;
  ranges.reserve(bricks.size());
  for (const std::int64_t brick : bricks) {
    const Place at = place(brick);
    ranges.push_back({at.start() - 8, at.start() + at.bytes()});
  }
  source_->will_read(std::move(ranges));
}

BrickBytes TagBricks::read(std::int64_t brick) const {
  const Block at = block(brick);
  const std::vector<std::byte> bytes = bytes_at(at.start - 8, at.bytes + 8);
  BrickBytes result;
  if (Status status = parse_bound_block(bytes, parameters(), brick, at.activity, result); !status.ok())
    throw broken_part(name(), "brick " + std::to_string(brick), at.start + at.bytes, status.what());
  return result;
}

std::function<bool(std::vector<std::byte>&)> TagBricks::envelope() const {
  const std::uint64_t start = end_of_pages(), end = start + end_.envelope_size;
  return [this, position = start, end,
          checksum = checksum_before(start)](std::vector<std::byte>& content) mutable {
    if (position == end) return false;
    const auto require = [&](const Status& status) {
      if (!status.ok()) throw broken_part(name(), "the envelope", position, status.what());
    };
    if (end - position < packed_head_size) require(Status::broken("an impossible size"));
    std::uint64_t rest = 0;
    require(parse_packed_head(bytes_at(position, packed_head_size), envelope_marker, envelope_content, rest));
    if (rest > end - position - packed_head_size) require(Status::broken("an impossible size"));
    require(parse_packed_block(bytes_at(position, packed_head_size + rest), checksum, &content));
    position += packed_head_size + rest;
    return true;
  };
}

std::vector<std::byte> TagBricks::beginning_of_envelope() const {
  std::vector<std::byte> content;
  envelope()(content);
  return content;
}

std::shared_ptr<const TagBricks> TagBricks::nested(const Member& member) const {
  auto nested = std::make_shared<const TagBricks>(bytes_of(member));
  require_nested(member, *nested);
  nested->require_parts_of(member);
  return nested;
}

void TagBricks::require_parts_of(const Member& member) const {
  // A volume may have overviews, which have no more members.
  if ((member.is_overview() && !index().members.empty()) || sizes().envelope > 0 || parity_)
    throw BrokenInput(name() + ": has parts that it must not have");
}

CodingParameters TagBricks::parameters_of(const Member& member) const {
  const HeaderOnly header(bytes_of(member));
  require_nested(member, header);
  return header.parameters();
}

std::string TagBricks::name_of(const Member& member) const {
  const HeaderOnly header(bytes_of(member));
  require_nested(member, header);
  return name_of_volume(header.header());
}

void TagBricks::require_nested(const Member& member, const IndexedTag& nested) const {
  if (Status status = check_nested(parameters(), member, nested.header()); !status.ok())
    throw BrokenInput(nested.name() + ": " + status.what());
}

void TagBricks::check(const Member& member) const {
  if (!is_bound(member))
    throw broken_part(name(), member.name().c_str(), member.end(),
                      member.is_overview()
                          ? "checksum mismatch: the overview is damaged; no voxel of the volume is"
                          : "checksum mismatch: it is damaged or of another file");
}

const Member& member_of_overview(const TagBricks& file, std::int64_t factor) {
  std::string there;
  for (const Member& member : file.index().members) {
    if (!member.is_overview()) continue;
    if (member.factor == factor) return member;
    there += (there.empty() ? "" : ", ") + std::to_string(member.factor);
  }
  there = there.empty() ? "it has none at all" : "it has " + there;
  if (factor == 1 || !file.parameters().has_step(factor))
    throw UsageError("{}: has no overview of {}; {}", file.name(), factor, there);
  throw UsageError("{}: has no overview of {}; {}; {} {} gives a smaller volume without one", file.name(),
                   factor, there, Setting{"step", "a step of"}, factor);
}

void require_volume(const IndexedTag& file, std::int64_t volume) {
  const int volumes = file.header().volumes;
  if (volume < 0 || volume >= volumes)
    throw UsageError(
        file.name() + ": no volume " + std::to_string(volume) +
        (volumes == 1 ? "; the only volume is 0" : "; the volumes are 0 to " + std::to_string(volumes - 1)));
}

const Member* member_of_volume(const TagBricks& file, std::int64_t volume) {
  require_volume(file, volume);
  return volume == 0 ? nullptr : &file.index().members[static_cast<std::size_t>(volume - 1)];
}

std::shared_ptr<const ByteSource> overview_in(const TagBricks& file, std::int64_t factor) {
  const Member& member = member_of_overview(file, factor);
  file.nested(member);
  return file.bytes_of(member);
}

std::shared_ptr<const ByteSource> volume_in(std::shared_ptr<const ByteSource> file, std::int64_t volume) {
  const TagBricks all(file);
  const Member* member = member_of_volume(all, volume);
  return member ? all.bytes_of(*member) : std::move(file);
}

std::shared_ptr<const TagBricks> volume_in(std::shared_ptr<const TagBricks> file, std::int64_t volume) {
  const Member* member = member_of_volume(*file, volume);
  return member ? file->nested(*member) : std::move(file);
}

}  // namespace tagrid
