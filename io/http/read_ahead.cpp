#include "io/http/read_ahead.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <utility>

namespace tagrid {
namespace {

// Small reads are often followed by others nearby: a length and then what has it.
constexpr std::uint64_t smallest_part = std::uint64_t{16} << 10;

}  // namespace

ReadAhead::ReadAhead(std::string name, std::uint64_t size, std::vector<std::byte> beginning, Fetch fetch)
    : name_(std::move(name)), size_(size), fetch_(std::move(fetch)) {
  assert(beginning.size() <= size);
  if (!beginning.empty()) parts_.push_back({{0, beginning.size()}, std::move(beginning), true});
}

ReadAhead::Parts::iterator ReadAhead::part_at(std::uint64_t position) const {
  return std::ranges::find_if(
      parts_, [&](const Part& part) { return part.range.begin <= position && position < part.range.end; });
}

// What is fetched for a read at a position that is in no part.
ByteRange ReadAhead::range_to_fetch(std::uint64_t position, std::uint64_t size) const {
  std::uint64_t wanted = std::max(size, smallest_part);
  const auto planned = std::ranges::find_if(
      plan_, [&](const ByteRange& range) { return range.begin <= position && position < range.end; });
  const auto before = std::ranges::find(parts_, position, [](const Part& part) { return part.range.end; });
  if (planned != plan_.end())
    wanted = std::max(planned->end - position, size);
  else if (before != parts_.end())
    wanted = std::max(2 * before->range.size(), size);
  ByteRange range = {position, position + std::min({wanted, largest_part, size_ - position})};
  for (const Part& part : parts_)
    if (part.range.begin > position) range.end = std::min(range.end, part.range.begin);
  return range;
}

void ReadAhead::make_room(std::uint64_t bytes) const {
  std::uint64_t sum = bytes;
  for (const Part& part : parts_) sum += part.range.size();
  for (auto part = parts_.end(); sum > kept_bytes && part != parts_.begin();) {
    --part;
    if (!part->is_there) continue;
    sum -= part->range.size();
    part = parts_.erase(part);
  }
}

// Calls `work` without the lock, so that others can read what is there.
template <class Work>
void ReadAhead::while_others_wait(std::unique_lock<std::mutex>& lock, Work work) const {
  ++fetching_;
  lock.unlock();
  const auto finish = [&] {
    lock.lock();
    --fetching_;
    changed_.notify_all();
  };
  try {
    work();
  } catch (...) {
    finish();
    ++failures_;
    failure_ = std::current_exception();
    throw;
  }
  finish();
}

void ReadAhead::fetch_part(std::unique_lock<std::mutex>& lock, const ByteRange& range) const {
  make_room(range.size());
  parts_.push_front({range, {}, false});
  const auto part = parts_.begin();
  try {
    while_others_wait(lock, [&] {
      std::vector<std::byte> bytes(static_cast<std::size_t>(range.size()));
      fetch_(range.begin, bytes);
      part->bytes = std::move(bytes);
    });
    part->is_there = true;
  } catch (...) {
    parts_.erase(part);
    throw;
  }
}

// More than is kept goes straight to where it is wanted.
void ReadAhead::fetch_all(std::unique_lock<std::mutex>& lock, std::uint64_t position,
                          std::span<std::byte> to) const {
  while_others_wait(lock, [&] { fetch_(position, to); });
}

void ReadAhead::read_at(std::uint64_t position, std::span<std::byte> to) const {
  assert(position <= size_ && to.size() <= size_ - position);
  std::unique_lock lock(mutex_);
  const std::size_t failures_before = failures_;
  while (!to.empty()) {
    if (failures_ != failures_before) std::rethrow_exception(failure_);
    const auto part = part_at(position);
    if (part == parts_.end()) {
      if (fetching_ >= most_at_once) {
        changed_.wait(lock);
        continue;
      }
      const ByteRange range = range_to_fetch(position, to.size());
      if (to.size() <= largest_part) {
        fetch_part(lock, range);
        continue;
      }
      const std::size_t size = std::min<std::size_t>(to.size(), static_cast<std::size_t>(range.size()));
      fetch_all(lock, position, to.first(size));
      position += size;
      to = to.subspan(size);
      continue;
    }
    if (!part->is_there) {
      changed_.wait(lock);
      continue;
    }
    parts_.splice(parts_.begin(), parts_, part);
    const auto from = static_cast<std::size_t>(position - part->range.begin);
    const std::size_t size = std::min(to.size(), part->bytes.size() - from);
    std::memcpy(to.data(), part->bytes.data() + from, size);
    position += size;
    to = to.subspan(size);
  }
}

void ReadAhead::will_read(std::vector<ByteRange> ranges) const {
  std::ranges::sort(ranges, {}, &ByteRange::begin);
  std::vector<ByteRange> plan;
  for (const ByteRange& range : ranges) {
    if (!plan.empty() && range.begin <= plan.back().end + largest_gap)
      plan.back().end = std::max(plan.back().end, range.end);
    else
      plan.push_back(range);
  }
  std::uint64_t in_gaps = 0;
  while (plan.size() > 1 && plan.size() <= few_ranges) {
    std::size_t nearest = 1;
    const auto gap_before = [&](std::size_t i) { return plan[i].begin - plan[i - 1].end; };
    for (std::size_t i = 2; i < plan.size(); ++i)
      if (gap_before(i) < gap_before(nearest)) nearest = i;
    in_gaps += gap_before(nearest);
    if (in_gaps > most_in_gaps) break;
    plan[nearest - 1].end = plan[nearest].end;
    plan.erase(plan.begin() + static_cast<std::ptrdiff_t>(nearest));
  }
  const std::lock_guard lock(mutex_);
  plan_ = std::move(plan);
}

}  // namespace tagrid
