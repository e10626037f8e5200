#include "io/tag/whole_bricks.h"

#include <cassert>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"

namespace tagrid {
namespace {

constexpr std::uint64_t bytes_of_checksum = 8;

std::uint64_t stored_checksum(std::span<const std::byte> block) {
  return load_little_endian<std::uint64_t>(block.last(bytes_of_checksum).data());
}

}  // namespace

WholeBricks::WholeBricks(std::shared_ptr<const ByteSource> source) : IndexedTag(std::move(source)) {
  read_index();
  look_at_bricks();
}

void WholeBricks::read_index(std::optional<std::uint64_t> last_checksum) {
  try {
    End end = read_end(last_checksum);
    index_ = std::move(end.index);
    index_start_ = end.start;
  } catch (const BrokenInput&) {
    // Damage is expected: index_ stays empty.
  }
}

std::vector<std::byte> WholeBricks::block_at(std::uint64_t position, std::int64_t brick) const {
  const std::uint64_t size = source_->size();
  if (position > size || size - position < block_frame_size) return {};
  const auto length = load_little_endian<std::uint32_t>(bytes_at(position, 4).data());
  if (length < 4 || length > largest_body(header_.parameters, brick)) return {};
  const std::uint64_t block = 4 + std::uint64_t{length} + bytes_of_checksum;
  return block <= size - position ? bytes_at(position, block) : std::vector<std::byte>();
}

void WholeBricks::look_at_bricks() {
  const std::int64_t count = header_.parameters.bricks().count();
  std::uint64_t position = header_size_, before = header_checksum_;
  // The correct checksum before the block, if the stored one is wrong and the previous block may be intact.
  std::optional<std::uint64_t> should_be;
  for (std::int64_t id = 0; id < count; ++id) {
    const std::vector<std::byte> block = block_at(position, id);
    std::uint64_t bytes = block.size();
    if (index_) {
      const IndexEntry& entry = index_->bricks[static_cast<std::size_t>(id)];
      bytes = block_frame_size + entry.activity_bytes + entry.value_bytes;
    }
    if (bytes == 0) break;  // nobody knows where the next brick begins
    Place place = {position, 0, false};
    std::optional<std::uint64_t> expected;
    if (block.size() == bytes) {
      place.own = own_checksum(std::span(block).first(bytes - bytes_of_checksum), id);
      expected = chained_checksum(place.own, before);
      place.is_whole = checksums_agree(stored_checksum(block), *expected);
      if (!place.is_whole && should_be) {
        const std::uint64_t other = chained_checksum(place.own, *should_be);
        if (checksums_agree(stored_checksum(block), other)) {
          place.is_whole = places_.back().is_whole = is_damaged_elsewhere_ = true;
          expected = other;
        }
      }
    }
    // Without the index, nothing binds what follows a lost brick to this file.
    if (!index_ && !places_.empty() && !places_.back().is_whole) break;
    places_.push_back(place);
    position += bytes;
    should_be = place.is_whole ? std::nullopt : expected;
    before = position <= source_->size() ? checksum_before(position) : 0;
  }
  if (static_cast<std::int64_t>(places_.size()) < count) return;
  if (index_) return look_at_envelope(position, before, should_be);
  if (!should_be) return;
  // Perhaps only the checksum of the last brick is damaged.
  read_index(should_be);
  if (index_) places_.back().is_whole = is_damaged_elsewhere_ = true;
}

void WholeBricks::look_at_envelope(std::uint64_t position, std::uint64_t before,
                                   std::optional<std::uint64_t> should_be) {
  const auto is_bound_to = [](const std::vector<std::byte>& block, std::uint64_t checksum) {
    return parse_envelope_block(block, checksum, nullptr).ok();
  };
  const std::uint64_t end = index_->members.empty() ? index_start_ : index_->members.front().offset;
  while (position < end) {
    const std::uint64_t left = end - position;
    std::uint64_t rest = 0;
    std::vector<std::byte> block;
    if (left >= envelope_head_size &&
        parse_envelope_head(bytes_at(position, envelope_head_size), rest).ok() &&
        rest <= left - envelope_head_size)
      block = bytes_at(position, envelope_head_size + rest);
    const bool fits = !block.empty() && is_bound_to(block, before);
    if (!fits) is_damaged_elsewhere_ = true;
    if (!fits && !block.empty() && should_be && is_bound_to(block, *should_be))
      places_.back().is_whole = true;
    else if (!fits)
      return look_at_members(checksum_before(end), std::nullopt);
    before = stored_checksum(block);
    should_be.reset();
    position += block.size();
  }
  look_at_members(before, should_be);
}

void WholeBricks::look_at_members(std::uint64_t before, std::optional<std::uint64_t> should_be) {
  for (const Member& member : index_->members) {
    const bool fits = is_bound(member, before);
    if (!fits) is_damaged_elsewhere_ = true;
    if (!fits && should_be && is_bound(member, *should_be)) places_.back().is_whole = true;
    before = checksum_before(member.end());
    should_be.reset();
  }
}

std::vector<BrickRun> WholeBricks::lost() const {
  std::vector<BrickRun> runs;
  const std::int64_t count = header_.parameters.bricks().count(),
                     known = static_cast<std::int64_t>(places_.size());
  for (std::int64_t id = 0; id < known; ++id)
    if (!is_whole(id)) append(runs, {id, id});
  if (known < count) append(runs, {known, count - 1});
  return runs;
}

BrickBytes WholeBricks::read(std::int64_t brick) const {
  assert(is_whole(brick));
  const Place& place = places_[static_cast<std::size_t>(brick)];
  const std::vector<std::byte> block = block_at(place.start, brick);
  if (block.empty() ||
      !checksums_agree(own_checksum(std::span(block).first(block.size() - bytes_of_checksum), brick),
                       place.own))
    throw broken_part(name(), "brick " + std::to_string(brick), place.start + block.size(),
                      "it changed while it was being read");
  // Its own checksum was compared, so the stored one no longer matters.
  BrickBytes bytes;
  if (Status status = split_block(block, brick, bytes); !status.ok())
    throw broken_part(name(), "brick " + std::to_string(brick), place.start + block.size(), status.what());
  return bytes;
}

}  // namespace tagrid
