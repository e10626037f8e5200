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

/// Finds the intact ("whole") bricks of a damaged file. A brick is intact if its checksum matches, which
/// depends on the number of the brick and on the checksum before it. It is also intact if only its stored
/// checksum is damaged: then the checksum of the next brick depends on the correct one. The index says where
/// bricks are. Without it, only the bricks before the first damage count, because nothing proves that later
/// ones belong to this file.
class WholeBricks : public IndexedTag {
 private:
  struct Place {
    std::uint64_t start = 0;
    std::uint64_t own = 0;  ///< its own_checksum(), if its length is possible
    bool is_whole = false;
  };

 public:
  /// Reads the entire file, and keeps 24 bytes for each brick that the file has room for. Throws BrokenInput
  /// if the header is damaged, and WorldError.
  explicit WholeBricks(std::shared_ptr<const ByteSource> source);

  std::uint64_t file_bytes() const { return source_->size(); }

  bool is_whole(std::int64_t brick) const {
    return brick < static_cast<std::int64_t>(places_.size()) &&
           places_[static_cast<std::size_t>(brick)].is_whole;
  }
  std::int64_t whole_count() const { return std::ranges::count(places_, true, &Place::is_whole); }
  /// The other bricks, in increasing order.
  std::vector<BrickRun> lost() const;
  /// The index; nothing if it is damaged or missing.
  const std::optional<TagIndex>& index() const { return index_; }
  /// True if something besides bricks is damaged: a stored checksum, the envelope, a member, the index, the footer.
  bool is_damaged_elsewhere() const { return !index_ || is_damaged_elsewhere_; }

  /// REQUIRES: is_whole(brick). Throws BrokenInput if the brick is no longer intact.
  BrickBytes read(std::int64_t brick) const;

 private:
  /// A brick from its length to its checksum; nothing if its length is impossible, or if the file ends in it.
  std::vector<std::byte> block_at(std::uint64_t position, std::int64_t brick) const;
  /// Reads the index, if `last_checksum` is the checksum before it; by default, that which is stored there.
  void read_index(std::optional<std::uint64_t> last_checksum = std::nullopt);
  void look_at_bricks();
  /// The last brick is intact if only its stored checksum is damaged and the next block depends on what it
  /// `should_be`. `position` is the end of the bricks, and `before` the checksum that is stored there.
  void look_at_envelope(std::uint64_t position, std::uint64_t before, std::optional<std::uint64_t> should_be);
  /// The same for the members.
  void look_at_members(std::uint64_t before, std::optional<std::uint64_t> should_be);

  std::optional<TagIndex> index_;
  std::uint64_t index_start_ = 0;
  bool is_damaged_elsewhere_ = false;
  std::vector<Place> places_;
};

}  // namespace tagrid
