// The index of a .tag file: pages with the sizes and statistics of bricks, and a directory of the pages and of
// the whole volume, which lies beside the footer. docs/dev/format.md specifies it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "io/tag/members.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/statistics.h"
#include "stages/sample/status.h"

namespace tagrid {

struct IndexEntry {
  std::uint32_t activity_bytes = 0;
  std::uint32_t value_bytes = 0;
  double low = 0, high = 0, mean = 0;  ///< of the brick's finite original samples
};

/// How the bricks of a file are divided into pages: all have the same number of bricks, except for the last one.
class PageLayout {
 public:
  /// A page has so many bricks, and twice as many as often as is needed to have no more than most_pages pages.
  static constexpr std::int64_t least_bricks = 4096;
  static constexpr std::int64_t most_pages = 6144;
  /// The most bricks of a page, so that sizes of pages have 32 bits.
  static constexpr std::int64_t most_bricks = std::int64_t{1} << 24;

  explicit PageLayout(std::int64_t bricks) : bricks_(bricks) {
    while (bricks_ > most_pages * per_page_ && per_page_ < most_bricks) per_page_ *= 2;
  }

  std::int64_t bricks() const { return bricks_; }
  std::int64_t per_page() const { return per_page_; }
  /// False if a file cannot have so many bricks.
  bool is_possible() const { return bricks_ <= most_pages * per_page_; }
  std::int64_t pages() const { return (bricks_ + per_page_ - 1) / per_page_; }
  std::int64_t page_of(std::int64_t brick) const { return brick / per_page_; }
  std::int64_t first(std::int64_t page) const { return page * per_page_; }
  std::int64_t bricks_in(std::int64_t page) const {
    return page + 1 < pages() ? per_page_ : bricks_ - first(page);
  }

 private:
  std::int64_t bricks_, per_page_ = least_bricks;
};

/// What the directory says of a page.
struct PageFacts {
  std::uint32_t sizes_bytes = 0, statistics_bytes = 0;  ///< of its two blocks
  std::uint64_t brick_bytes = 0;                        ///< of the blocks of its bricks, before them
  /// Of the finite original samples of its bricks; infinity and -infinity if there are none.
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();

  std::uint64_t bytes() const { return brick_bytes + sizes_bytes + statistics_bytes; }
  bool operator==(const PageFacts&) const = default;
};

/// The directory of the index.
struct TagIndex {
  Statistics total;
  std::uint64_t activity_bytes = 0, value_bytes = 0;  ///< of all bricks
  std::vector<PageFacts> pages;
  std::vector<Member> members;  ///< in the order of the file
  /// Kinds of the optional sections that this program does not know.
  std::vector<std::uint32_t> unknown_sections;
};

/// The form of an index: which fields it has.
struct IndexForm {
  int levels = 0;       ///< whose active points are counted: none if the file stores no grid
  bool floats = false;  ///< the volume has floats, whose sum of squared errors is a float
  bool mesh = false;    ///< the mesh of the file has a bound, so its error is recorded
  int volumes = 1;      ///< all but the first one are members
  std::size_t thresholds = 0;
};
IndexForm index_form(const CodingParameters& parameters);

/// The largest number of bytes of a directory. With what is around it, it is in the last 256 KiB of a file.
inline constexpr std::uint64_t largest_directory = (1 << 18) - (1 << 12);

/// False if a directory with so many pages could not name the members of a file with so many volumes.
constexpr bool has_room_for_volumes(std::int64_t pages, std::int64_t volumes) {
  return pages * 32 + volumes * 24 <= (1 << 18) - (1 << 13);
}

/// Kinds of sections of the directory. A reader must know those below first_optional_section.
inline constexpr std::uint32_t volume_section = 1, pages_section = 2, members_section = 3,
                               first_optional_section = 1 << 16;

/// Bytes of the sections that every file has.
std::uint64_t least_directory_size(std::int64_t pages, const IndexForm& form);

/// The directory, not yet compressed, without sections that are not known.
std::vector<std::byte> serialize_directory(const TagIndex& index, const IndexForm& form);

/// Reads the directory. `pages` and `form` are those of the header; any other number of pages is broken. Where
/// members are is not checked.
Status parse_directory(std::span<const std::byte> bytes, std::int64_t pages, const IndexForm& form,
                       TagIndex& index);

/// Checks that the extremes of the volume are those of its pages.
Status check_extremes(const TagIndex& index);

/// Bytes of a brick's entry in the two parts of a page.
inline constexpr std::uint64_t sizes_entry = 2 * 4, statistics_entry = 3 * 8;

/// The columns of the two parts of a page, not yet compressed.
std::vector<std::byte> serialize_sizes(std::span<const IndexEntry> bricks);
std::vector<std::byte> serialize_statistics(std::span<const IndexEntry> bricks);
/// The reverse. REQUIRES: `bytes` has as many as the bricks take.
void parse_sizes(std::span<const std::byte> bytes, std::span<IndexEntry> bricks);
void parse_statistics(std::span<const std::byte> bytes, std::span<IndexEntry> bricks);

/// The smallest and the largest value of a page.
void take_range(std::span<const IndexEntry> bricks, PageFacts& page);

}  // namespace tagrid
