#include "io/tag/whole_bricks.h"

#include <cassert>

#include "io/bytes/checksum.h"
#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/parity/parity.h"

namespace tagrid {
namespace {

constexpr std::uint64_t bytes_of_checksum = 8;

std::uint64_t stored_checksum(std::span<const std::byte> block) {
  return load_little_endian<std::uint64_t>(block.last(bytes_of_checksum).data());
}

}  // namespace

DamagedTag::DamagedTag(std::shared_ptr<const ByteSource> source) : IndexedTag(std::move(source)) {
  if (has_read_index() || parity_) return;
  // If the end of the parity is damaged or lost, another part of it says where the footer is.
  parity_ = search_for_parity(*source_);
  if (!parity_) return;
  is_end_damaged_ = true;
  source_ = beginning_of(source_, std::min(parity_->file_size, source_->size()));
  has_read_index();
}

bool DamagedTag::has_read_index() {
  try {
    End end = read_end();
    index_ = std::move(end.index);
    index_start_ = end.start;
  } catch (const BrokenInput& broken) {
    // Damage is expected: index_ stays empty.
    if (is_newer_format(broken)) throw;
  }
  return index_.has_value();
}

std::shared_ptr<const ByteSource> DamagedTag::volume(std::int64_t number) const {
  assert(number != 0);
  require_volume(*this, number);
  if (!index_)
    throw BrokenInput("{}: volume {} cannot be found: the end of the file is damaged", name(), number);
  return bytes_of(index_->members[static_cast<std::size_t>(number - 1)]);
}

WholeBricks::WholeBricks(std::shared_ptr<const ByteSource> source) : DamagedTag(std::move(source)) {
  if (index()) pages_.emplace(source_, header_size_, header_.parameters.bricks().count(), index()->pages);
  look_at_bricks();
}

std::vector<std::byte> WholeBricks::block_at(std::uint64_t position, std::int64_t brick) const {
  const std::uint64_t size = source_->size();
  if (position > size || size - position < block_frame_size) return {};
  const auto length = load_little_endian<std::uint32_t>(bytes_at(position, 4).data());
  if (length < 4 || length > largest_body(header_.parameters, brick)) return {};
  const std::uint64_t block = 4 + std::uint64_t{length} + bytes_of_checksum;
  return block <= size - position ? bytes_at(position, block) : std::vector<std::byte>();
}

std::vector<std::uint64_t> WholeBricks::starts_of(std::int64_t page) const {
  if (!pages_) return {};
  try {
    return pages_->sizes(page)->starts;
  } catch (const BrokenInput&) {
    return {};
  }
}

std::optional<IndexEntry> WholeBricks::statistics(std::int64_t brick) const {
  if (!pages_) return std::nullopt;
  const std::int64_t page = pages_->layout().page_of(brick);
  try {
    return (*pages_->statistics(page))[static_cast<std::size_t>(brick - pages_->layout().first(page))];
  } catch (const BrokenInput&) {
    return std::nullopt;
  }
}

bool WholeBricks::look_at_brick(Walk& walk, std::uint64_t bytes) {
  const auto id = static_cast<std::int64_t>(places_.size());
  const std::vector<std::byte> block = block_at(walk.position, id);
  if (bytes == 0) bytes = block.size();
  if (bytes == 0) return false;
  Place place = {walk.position, 0, false};
  std::optional<std::uint64_t> expected;
  if (block.size() == bytes) {
    place.own = own_checksum(std::span(block).first(bytes - bytes_of_checksum), id);
    expected = chained_checksum(place.own, walk.before);
    place.is_whole = checksums_agree(stored_checksum(block), *expected);
    if (!place.is_whole && walk.should_be) {
      const std::uint64_t other = chained_checksum(place.own, *walk.should_be);
      if (checksums_agree(stored_checksum(block), other)) {
        place.is_whole = is_damaged_elsewhere_ = true;
        if (walk.is_of_brick) places_.back().is_whole = true;
        expected = other;
      }
    }
  }
  places_.push_back(place);
  walk.position += bytes;
  walk.should_be = place.is_whole ? std::nullopt : expected;
  walk.is_of_brick = true;
  walk.before = walk.position <= source_->size() ? checksum_before(walk.position) : 0;
  return true;
}

bool WholeBricks::look_at_packed(Walk& walk, std::uint32_t marker, ContentSize possible, std::uint64_t end) {
  const auto is_bound_to = [](const std::vector<std::byte>& block, std::uint64_t checksum) {
    return parse_packed_block(block, checksum, nullptr).ok();
  };
  const std::uint64_t left = end - std::min(end, walk.position);
  std::uint64_t rest = 0;
  std::vector<std::byte> block;
  if (left >= packed_head_size &&
      parse_packed_head(bytes_at(walk.position, packed_head_size), marker, possible, rest).ok() &&
      rest <= left - packed_head_size)
    block = bytes_at(walk.position, packed_head_size + rest);
  const bool fits = !block.empty() && is_bound_to(block, walk.before);
  if (!fits) is_damaged_elsewhere_ = true;
  if (!fits && !block.empty() && walk.should_be && walk.is_of_brick && is_bound_to(block, *walk.should_be)) {
    places_.back().is_whole = true;
  } else if (!fits) {
    // Perhaps only the checksum that is stored at its end is damaged.
    walk.should_be = block.empty() ? std::nullopt : std::optional(packed_checksum(block, walk.before));
    walk.is_of_brick = false;
    return false;
  }
  walk = {walk.position + block.size(), stored_checksum(block)};
  return true;
}

void WholeBricks::look_at_bricks() {
  const PageLayout layout(header_.parameters.bricks().count());
  Walk walk = {header_size_, header_checksum_};
  for (std::int64_t page = 0; page < layout.pages(); ++page) {
    const std::int64_t bricks = layout.bricks_in(page), end = layout.first(page) + bricks;
    const std::vector<std::uint64_t> starts = starts_of(page);
    for (std::int64_t i = 0; i < bricks; ++i) {
      const auto n = static_cast<std::size_t>(i);
      // Without the sizes, nothing binds what follows a lost brick to this file.
      if (starts.empty() && i > 0 && !places_.back().is_whole) break;
      if (!look_at_brick(walk, starts.empty() ? 0 : starts[n + 1] - starts[n])) break;
    }
    if (!index() && static_cast<std::int64_t>(places_.size()) < end) return;
    // Bricks that nobody finds; the directory says where the next page is.
    const bool are_found = static_cast<std::int64_t>(places_.size()) == end;
    places_.resize(static_cast<std::size_t>(end));
    const auto content = static_cast<std::uint64_t>(bricks);
    const std::uint64_t sizes = content * sizes_entry, statistics = content * statistics_entry,
                        limit = index() ? pages_->start(page + 1) : source_->size();
    const bool is_page_whole = are_found && look_at_packed(walk, sizes_marker, {sizes, sizes}, limit) &&
                               look_at_packed(walk, statistics_marker, {statistics, statistics}, limit);
    if (is_page_whole) continue;
    is_damaged_elsewhere_ = true;
    if (!index()) return;
    walk.position = pages_->start(page + 1);
    walk.before = checksum_before(walk.position);
    if (walk.is_of_brick) walk.should_be.reset();
  }
  if (!index()) return;
  const std::uint64_t end = index()->members.empty() ? index_start_ : index()->members.front().offset;
  while (walk.position < end && look_at_packed(walk, envelope_marker, envelope_content, end)) {
  }
  for (const Member& member : index()->members)
    if (!is_bound(member)) damaged_members_.push_back(member);
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
