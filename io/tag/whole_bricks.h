// What is whole in a damaged .tag file.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/files/byte_source.h"
#include "io/tag/blocks.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "stages/grid/brick_run.h"

namespace tagrid {

/// Finds the bricks of a damaged file that are whole. A brick is whole if its checksum says so, which is bound to the number
/// of the brick and to the checksum before it. It is also whole if only its stored checksum is damaged: then the
/// checksum of the brick behind it is bound to what it should be. The index says where bricks are. Without the index,
/// only the bricks in front of the first damage count: nothing says that those behind it belong to this file. Several
/// threads may call all const functions at once.
class WholeBricks {
 public:
  /// Reads the whole file, calls `looked` with the number of bytes after each brick, and keeps 24 bytes for each brick that the
  /// file has room for. Throws BrokenInput if the header is not whole, WorldError, and the exceptions of `looked`.
  explicit WholeBricks(std::shared_ptr<const ByteSource> source,
                       const std::function<void(std::uint64_t bytes)>& looked = {});

  const TagHeader& header() const { return header_; }
  const std::string& name() const { return source_->name(); }
  std::uint64_t file_bytes() const { return source_->size(); }

  bool is_whole(std::int64_t brick) const {
    return brick < static_cast<std::int64_t>(places_.size()) &&
           places_[static_cast<std::size_t>(brick)].is_whole;
  }
  /// The bricks that are not, in increasing order.
  std::vector<BrickRun> lost() const;
  /// The index; nothing if it is damaged or missing.
  const std::optional<TagIndex>& index() const { return index_; }
  /// True if something is damaged although all bricks are whole: a stored checksum, the index, the footer.
  bool is_damaged_elsewhere() const { return !index_ || checksum_is_damaged_; }

  /// REQUIRES: is_whole(brick). Throws BrokenInput if the brick is no longer whole.
  BrickBytes read(std::int64_t brick) const;

 private:
  struct Place {
    std::uint64_t start = 0;
    std::uint64_t own = 0;  ///< its own_checksum(), if its length is possible
    bool is_whole = false;
  };

  std::vector<std::byte> bytes_at(std::uint64_t position, std::uint64_t size) const;
  /// A brick from its length to its checksum; nothing if its length is impossible, or if the file ends in it.
  std::vector<std::byte> block_at(std::uint64_t position, std::int64_t brick) const;
  void read_header();
  /// Reads the index, if `last_checksum` is the checksum before it; by default, that which is stored there.
  void read_index(std::optional<std::uint64_t> last_checksum = std::nullopt);
  void look_at_bricks(const std::function<void(std::uint64_t bytes)>& looked);

  std::shared_ptr<const ByteSource> source_;
  TagHeader header_;
  std::uint64_t header_size_ = 0, header_checksum_ = 0;
  std::optional<TagIndex> index_;
  bool checksum_is_damaged_ = false;
  std::vector<Place> places_;
};

}  // namespace tagrid
