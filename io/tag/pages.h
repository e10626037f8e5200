// The pages of an index: 4,096 bricks each, behind their bricks. They are written when their bricks are, and
// read when one of them is requested.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "io/files/byte_sink.h"
#include "io/files/byte_source.h"
#include "io/tag/index.h"

namespace tagrid {

/// The first field of the two blocks of a page, where a brick has its length, which is never 2 or 3.
inline constexpr std::uint32_t sizes_marker = 2, statistics_marker = 3;

/// A page, for messages: "page 1 of the index (bricks 4096 to 8191)".
std::string name_of_page(const PageLayout& layout, std::int64_t page);
/// The most bricks of a page if a file claims `bricks`: a double, as a damaged one may claim more than 2^63.
double bricks_of_page(double bricks);

/// Makes the index of a file while its bricks are written. Holds the entries of one page.
class PageBlocks {
 public:
  /// `checksum` is that of the last block of the file; it is continued. It and `out` must outlive this object. Throws
  /// UsageError if a file cannot have so many bricks.
  PageBlocks(std::int64_t bricks, std::uint64_t& checksum, ByteSink& out);

  /// After the block of a brick was written. The last brick of a page is followed by the blocks of the page.
  void add(std::size_t activity_bytes, std::size_t value_bytes, const Statistics& brick);
  /// After a member was written.
  void add(const Member& member) { index_.members.push_back(member); }
  /// True between pages: add() has just written one, or nothing was added.
  bool is_between_pages() const { return page_.empty(); }

  const TagIndex& index() const { return index_; }

  /// The most memory for a page of a file of so many bricks while it is written, or read front to back.
  static double memory(double bricks);

 private:
  void finish_page();

  PageLayout layout_;
  std::uint64_t& checksum_;
  ByteSink& out_;
  std::int64_t added_ = 0;
  std::vector<IndexEntry> page_;
  TagIndex index_;
};

/// Bytes of the two blocks of a page.
std::size_t bytes_of_page(std::span<const IndexEntry> bricks);

/// Bytes from `position` on. Throws BrokenInput if the source ends before: a false size takes no memory.
std::vector<std::byte> bytes_at(const ByteSource& source, std::uint64_t position, std::uint64_t size);

/// Reads pages by the directory, and keeps those that are in use. Several threads may call all functions.
class TagPages {
 public:
  /// Where the blocks of the bricks of a page begin, the end of the last one, and bytes of their activity.
  struct Sizes {
    std::vector<std::uint64_t> starts;
    std::vector<std::uint32_t> activity;
  };

  /// REQUIRES: the facts of the pages were checked; see FileEnd.
  TagPages(std::shared_ptr<const ByteSource> source, std::uint64_t header_size, std::int64_t bricks,
           const std::vector<PageFacts>& pages);

  const PageLayout& layout() const { return layout_; }
  /// Position of the first brick of a page; of the page after the last one: where all pages end.
  std::uint64_t start(std::int64_t page) const { return starts_[static_cast<std::size_t>(page)]; }

  /// The parts of a page. Throw BrokenInput, which names the page and its bricks.
  std::shared_ptr<const Sizes> sizes(std::int64_t page) const;
  std::shared_ptr<const std::vector<IndexEntry>> statistics(std::int64_t page) const;  ///< without sizes

  /// The most memory that all of this takes for a file of so many bricks.
  static double memory(double bricks);

 private:
  struct Kept;
  /// The columns of a block of `size` bytes, whose entries have `entry` bytes each.
  std::vector<std::byte> columns(std::int64_t page, std::uint32_t marker, std::uint64_t position,
                                 std::uint64_t size, std::uint64_t entry) const;
  [[noreturn]] void fail(std::int64_t page, std::uint64_t before, const std::string& what) const;
  const PageFacts& facts(std::int64_t page) const { return facts_[static_cast<std::size_t>(page)]; }

  std::shared_ptr<const ByteSource> source_;
  PageLayout layout_;
  std::vector<PageFacts> facts_;
  std::vector<std::uint64_t> starts_;
  std::shared_ptr<Kept> kept_;
};

}  // namespace tagrid
