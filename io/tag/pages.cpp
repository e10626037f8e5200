#include "io/tag/pages.h"

#include <algorithm>
#include <cassert>
#include <future>
#include <mutex>
#include <utility>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/bytes/zstd_bytes.h"
#include "io/errors/errors.h"
#include "io/tag/blocks.h"

namespace tagrid {
namespace {

// Pages that are kept: enough for as many threads as read bricks of one file at different places.
constexpr std::size_t kept_pages = 64;
// Of larger pages, so many bytes are kept, and at least two pages.
constexpr std::uint64_t kept_bytes = std::uint64_t{4} << 20;

std::size_t pages_to_keep(std::uint64_t bytes_of_page) {
  return std::clamp<std::size_t>(static_cast<std::size_t>(kept_bytes / bytes_of_page), 2, kept_pages);
}

/// The parts that were used last. A part is read once, however many threads ask for it at a time.
template <class Part>
class Recent {
 public:
  using Pointer = std::shared_ptr<const Part>;

  explicit Recent(std::size_t most) : most_(most) {}

  /// The part of a page, which `read` makes if it is not there. What `read` throws, all get that wait for it.
  template <class Read>
  Pointer get(std::int64_t page, Read read) {
    std::promise<Pointer> promise;
    const auto [part, is_known] = find_or_add(page, promise);
    if (is_known) return part.get();
    try {
      promise.set_value(read());
    } catch (...) {
      remove(page);
      promise.set_exception(std::current_exception());
    }
    return part.get();
  }

 private:
  using Future = std::shared_future<Pointer>;

  std::pair<Future, bool> find_or_add(std::int64_t page, std::promise<Pointer>& promise) {
    const std::lock_guard lock(mutex_);
    const auto at = place_of(page);
    const bool is_known = at != parts_.end();
    if (is_known) {
      std::rotate(parts_.begin(), at, at + 1);
    } else {
      if (parts_.size() == most_) parts_.pop_back();
      parts_.insert(parts_.begin(), {page, promise.get_future().share()});
    }
    return {parts_.front().second, is_known};
  }
  void remove(std::int64_t page) {
    const std::lock_guard lock(mutex_);
    if (const auto at = place_of(page); at != parts_.end()) parts_.erase(at);
  }
  auto place_of(std::int64_t page) {
    return std::find_if(parts_.begin(), parts_.end(), [&](const auto& p) { return p.first == page; });
  }

  std::size_t most_;
  std::mutex mutex_;
  std::vector<std::pair<std::int64_t, Future>> parts_;  // the last one used is first
};

constexpr std::uint64_t bytes_of_sizes = sizeof(std::uint64_t) + sizeof(std::uint32_t);

}  // namespace

double bricks_of_page(double bricks) {
  const PageLayout layout(static_cast<std::int64_t>(std::min(bricks, 4e18)));
  return std::min(bricks, static_cast<double>(layout.per_page()));
}

std::string name_of_page(const PageLayout& layout, std::int64_t page) {
  const std::int64_t first = layout.first(page), last = first + layout.bricks_in(page) - 1;
  return "page " + std::to_string(page) + " of the index (bricks " + std::to_string(first) + " to " +
         std::to_string(last) + ")";
}

PageBlocks::PageBlocks(std::int64_t bricks, std::uint64_t& checksum, ByteSink& out)
    : layout_(bricks), checksum_(checksum), out_(out) {
  if (!layout_.is_possible())
    throw UsageError("a file of {} bricks is not possible, only of {}; take larger bricks ({})", bricks,
                     PageLayout::most_pages * PageLayout::most_bricks, Setting{"brick", "their edge"});
}

void PageBlocks::add(std::size_t activity_bytes, std::size_t value_bytes, const Statistics& brick) {
  const double mean = brick.finite == 0 ? 0 : brick.sum / static_cast<double>(brick.finite);
  page_.push_back({static_cast<std::uint32_t>(activity_bytes), static_cast<std::uint32_t>(value_bytes),
                   brick.low, brick.high, mean});
  index_.activity_bytes += activity_bytes;
  index_.value_bytes += value_bytes;
  index_.total.add(brick);
  ++added_;
  assert(added_ <= layout_.bricks());
  if (static_cast<std::int64_t>(page_.size()) == layout_.per_page() || added_ == layout_.bricks())
    finish_page();
}

void PageBlocks::finish_page() {
  PageFacts facts;
  for (const IndexEntry& brick : page_)
    facts.brick_bytes += block_frame_size + brick.activity_bytes + brick.value_bytes;
  take_range(page_, facts);
  const auto write = [&](std::uint32_t marker, const std::vector<std::byte>& columns) {
    const std::vector<std::byte> block = packed_block(marker, columns, checksum_);
    out_.write(block);
    return static_cast<std::uint32_t>(block.size());
  };
  facts.sizes_bytes = write(sizes_marker, serialize_sizes(page_));
  facts.statistics_bytes = write(statistics_marker, serialize_statistics(page_));
  index_.pages.push_back(facts);
  page_.clear();
}

// Entries, their bytes and the packed ones, as they grow by copying; for zstd ten times as much, but at most its
// window; and the directory, thrice.
double PageBlocks::memory(double bricks) {
  const double page = bricks_of_page(bricks) * static_cast<double>(sizeof(IndexEntry));
  return 5 * page + std::min(10 * page, 40e6) + 3 * static_cast<double>(largest_directory);
}

std::size_t bytes_of_page(std::span<const IndexEntry> bricks) {
  std::uint64_t checksum = 0;
  return packed_block(sizes_marker, serialize_sizes(bricks), checksum).size() +
         packed_block(statistics_marker, serialize_statistics(bricks), checksum).size();
}

std::vector<std::byte> bytes_at(const ByteSource& source, std::uint64_t position, std::uint64_t size) {
  if (position > source.size() || size > source.size() - position)
    throw BrokenInput(source.name() + ": before byte " + std::to_string(position + size) +
                      ": the file ends; it is truncated");
  source.expect(position, size);
  std::vector<std::byte> bytes(memory_size(size));
  source.read_at(position, bytes);
  return bytes;
}

struct TagPages::Kept {
  explicit Kept(const PageLayout& layout)
      : sizes(pages_to_keep(static_cast<std::uint64_t>(layout.per_page()) * bytes_of_sizes)),
        statistics(pages_to_keep(static_cast<std::uint64_t>(layout.per_page()) * sizeof(IndexEntry))) {}

  Recent<Sizes> sizes;
  Recent<std::vector<IndexEntry>> statistics;
};

TagPages::TagPages(std::shared_ptr<const ByteSource> source, std::uint64_t header_size, std::int64_t bricks,
                   const std::vector<PageFacts>& pages)
    : source_(std::move(source)),
      layout_(bricks),
      facts_(pages),
      starts_{header_size},
      kept_(std::make_shared<Kept>(layout_)) {
  for (const PageFacts& page : facts_) starts_.push_back(starts_.back() + page.bytes());
}

// The directory packed, unpacked, and in memory with what follows from it; the pages that are kept; and one
// of each part that is being read.
double TagPages::memory(double bricks) {
  const double per_page = bricks_of_page(bricks);
  const double directory = 3.0 * (1 << 18);
  const double kept = std::min(bricks, std::max(2 * per_page, 64 * 4096.0)) *
                      static_cast<double>(bytes_of_sizes + sizeof(IndexEntry));
  return directory + std::min(kept, 2 * std::max(2 * per_page * sizeof(IndexEntry), double{kept_bytes})) +
         3 * per_page * static_cast<double>(sizeof(IndexEntry));
}

void TagPages::fail(std::int64_t page, std::uint64_t before, const std::string& what) const {
  throw broken_part(source_->name(), name_of_page(layout_, page), before, what);
}

std::vector<std::byte> TagPages::columns(std::int64_t page, std::uint32_t marker, std::uint64_t position,
                                         std::uint64_t size, std::uint64_t entry) const {
  const std::uint64_t content = static_cast<std::uint64_t>(layout_.bricks_in(page)) * entry;
  const std::vector<std::byte> bytes = bytes_at(*source_, position - 8, size + 8);
  const auto block = std::span(bytes).subspan(8);
  auto checksum = load_little_endian<std::uint64_t>(bytes.data());
  std::uint64_t rest = 0;
  std::vector<std::byte> columns;
  Status status = parse_packed_head(block.first(packed_head_size), marker, {content, content}, rest);
  if (status.ok() && packed_head_size + rest != size) status = Status::broken("an impossible size");
  if (status.ok()) status = parse_packed_block(block, checksum, &columns);
  if (!status.ok()) fail(page, position + size, status.what());
  return columns;
}

std::shared_ptr<const TagPages::Sizes> TagPages::sizes(std::int64_t page) const {
  return kept_->sizes.get(page, [&] {
    const PageFacts& known = facts(page);
    const std::uint64_t position = start(page) + known.brick_bytes;
    // Memory for the entries is taken when their bytes are there.
    const std::vector<std::byte> bytes =
        columns(page, sizes_marker, position, known.sizes_bytes, sizes_entry);
    std::vector<IndexEntry> bricks(static_cast<std::size_t>(layout_.bricks_in(page)));
    parse_sizes(bytes, bricks);
    const auto sizes = std::make_shared<Sizes>();
    sizes->starts = {start(page)};
    sizes->starts.reserve(bricks.size() + 1);
    sizes->activity.reserve(bricks.size());
    for (const IndexEntry& brick : bricks) {
      sizes->starts.push_back(sizes->starts.back() + block_frame_size + brick.activity_bytes +
                              brick.value_bytes);
      sizes->activity.push_back(brick.activity_bytes);
    }
    if (sizes->starts.back() != position)
      fail(page, position + known.sizes_bytes, "the sizes of its bricks do not add up");
    return sizes;
  });
}

std::shared_ptr<const std::vector<IndexEntry>> TagPages::statistics(std::int64_t page) const {
  return kept_->statistics.get(page, [&] {
    const PageFacts& known = facts(page);
    const std::uint64_t position = start(page) + known.brick_bytes + known.sizes_bytes;
    const std::vector<std::byte> bytes =
        columns(page, statistics_marker, position, known.statistics_bytes, statistics_entry);
    const auto bricks =
        std::make_shared<std::vector<IndexEntry>>(static_cast<std::size_t>(layout_.bricks_in(page)));
    parse_statistics(bytes, *bricks);
    PageFacts range;
    take_range(*bricks, range);
    if (range.low != known.low || range.high != known.high)
      fail(page, position + known.statistics_bytes, "its values are not those in the directory");
    return bricks;
  });
}

}  // namespace tagrid
