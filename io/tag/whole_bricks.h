// The intact bricks of a damaged .tag file.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/tag/bricks.h"
#include "stages/grid/brick_grid.h"

namespace tagrid {

/// A damaged .tag file: its header, and where its volumes are.
class DamagedTag : public IndexedTag {
 public:
  /// If the end of the file is damaged, reads all of it in search of parity, which says where the directory is.
  /// Throws BrokenInput if the header is damaged, or the file needs a newer program, and WorldError.
  explicit DamagedTag(std::shared_ptr<const ByteSource> source);

  /// The directory of the index; nothing if it is damaged or missing.
  const std::optional<TagIndex>& index() const { return index_; }
  bool has_parity() const { return parity_.has_value(); }
  /// The bytes of a volume after the first, which is the file itself. Throws BrokenInput if the directory is damaged,
  /// and UsageError if there is no such volume. REQUIRES: number != 0.
  std::shared_ptr<const ByteSource> volume(std::int64_t number) const;

 protected:
  std::uint64_t index_start_ = 0;
  bool is_end_damaged_ = false;  ///< only parity says where the file ends

 private:
  bool has_read_index();

  std::optional<TagIndex> index_;
};

/// Finds the intact ("whole") bricks of a damaged file. A brick is intact if its checksum matches, which
/// depends on the number of the brick and on the checksum before it. It is also intact if only its stored
/// checksum is damaged: then the checksum of the next block depends on the correct one. The pages of the index
/// say where bricks are. If a page is damaged, the lengths of its bricks lead from one to the next, from the
/// place that the directory gives to the first damage among them. If the directory is damaged, only the bricks
/// before the first damage count, because nothing proves that later ones belong to this file.
class WholeBricks : public DamagedTag {
 private:
  struct Place {
    std::uint64_t start = 0;
    std::uint64_t own = 0;  ///< its own_checksum(), if its length is possible
    bool is_whole = false;
  };

 public:
  /// Reads the entire file, and keeps 24 bytes for each brick that the file has room for. Throws as DamagedTag does.
  explicit WholeBricks(std::shared_ptr<const ByteSource> source);

  std::uint64_t file_bytes() const { return source_->size(); }

  bool is_whole(std::int64_t brick) const {
    return brick < static_cast<std::int64_t>(places_.size()) &&
           places_[static_cast<std::size_t>(brick)].is_whole;
  }
  std::int64_t whole_count() const { return std::ranges::count(places_, true, &Place::is_whole); }
  /// The other bricks, in increasing order.
  std::vector<BrickRun> lost() const;
  /// The statistics of a brick; nothing if they are damaged or missing.
  std::optional<IndexEntry> statistics(std::int64_t brick) const;
  /// The members whose checksum, or the one before it, is damaged. None if the directory is damaged.
  const std::vector<Member>& damaged_members() const { return damaged_members_; }
  /// True if something besides bricks is damaged: a stored checksum, the envelope, a member, the index, the
  /// footer.
  bool is_damaged_elsewhere() const {
    return !index() || is_end_damaged_ || is_damaged_elsewhere_ || !damaged_members_.empty();
  }

  /// REQUIRES: is_whole(brick). Throws BrokenInput if the brick is no longer intact.
  BrickBytes read(std::int64_t brick) const;

 private:
  /// A brick from its length to its checksum; nothing if its length is impossible, or if the file ends in it.
  std::vector<std::byte> block_at(std::uint64_t position, std::int64_t brick) const;
  void look_at_bricks();
  /// Where the bricks of a page begin and the last one ends, by its sizes; nothing if these are damaged.
  std::vector<std::uint64_t> starts_of(std::int64_t page) const;

  /// The place up to which the file was looked at.
  struct Walk {
    std::uint64_t position = 0, before = 0;  ///< and the checksum that is stored before it
    /// The correct checksum, if the stored one is wrong and the previous block may be intact.
    std::optional<std::uint64_t> should_be = {};
    bool is_of_brick = true;  ///< that block is a brick, the last one that was looked at
  };
  /// Looks at the next brick, whose block has so many bytes; 0: its length says how many. False if nobody knows
  /// where the next one begins.
  bool look_at_brick(Walk& walk, std::uint64_t bytes);
  /// Looks at a packed block before `end`. The last brick is intact if only its stored checksum is damaged and
  /// this block depends on what it should be. False if nobody knows where the next block begins.
  bool look_at_packed(Walk& walk, std::uint32_t marker, ContentSize possible, std::uint64_t end);

  std::optional<TagPages> pages_;
  bool is_damaged_elsewhere_ = false;
  std::vector<Member> damaged_members_;
  std::vector<Place> places_;
};

}  // namespace tagrid
