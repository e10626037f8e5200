// Reads the bricks of a .tag file in any order, by its index.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/files/byte_source.h"
#include "io/parity/layout.h"
#include "io/tag/blocks.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "io/tag/pages.h"

namespace tagrid {

class TagReader;

/// A .tag file that is read in any order. Several threads may call all const functions at once.
class IndexedTag {
 public:
  const TagHeader& header() const { return header_; }
  const CodingParameters& parameters() const { return header_.parameters; }
  const std::string& name() const { return source_->name(); }
  /// The bytes of a member of the index.
  std::shared_ptr<const ByteSource> bytes_of(const Member& member) const;

 protected:
  /// The directory of the index, and the footer.
  struct End {
    TagIndex index;
    std::uint64_t start = 0;          ///< of the directory
    std::uint64_t envelope_size = 0;  ///< of the envelope before it
  };

  /// Reads and checks the header. Throws BrokenInput.
  explicit IndexedTag(std::shared_ptr<const ByteSource> source);
  std::vector<std::byte> bytes_at(std::uint64_t position, std::uint64_t size) const {
    return tagrid::bytes_at(*source_, position, size);
  }
  /// The checksum that is stored before a position.
  std::uint64_t checksum_before(std::uint64_t position) const;
  /// Reads and checks directory and footer, in one read of at most largest_end bytes; in two if parity follows
  /// them, which source_ then no longer has. Throws BrokenInput.
  End read_end();
  /// True if a member of the index is in the file, with its checksum, which continues the one before it. Reads
  /// all of it.
  bool is_bound(const Member& member) const;

  std::shared_ptr<const ByteSource> source_;
  std::optional<ParityLayout> parity_;
  TagHeader header_;
  std::uint64_t header_size_ = 0, header_checksum_ = 0;
};

/// A file of which only the header is read. Throws BrokenInput.
struct HeaderOnly : IndexedTag {
  explicit HeaderOnly(std::shared_ptr<const ByteSource> source) : IndexedTag(std::move(source)) {}
};

/// Reads a .tag file by its index: the header, directory and footer at once, and a brick when it is requested,
/// with the page that knows where it is. Wrong bytes throw BrokenInput, which says where they are.
class TagBricks : public IndexedTag {
 public:
  /// Reads header, directory and footer, and checks them.
  explicit TagBricks(std::shared_ptr<const ByteSource> source);

  const TagIndex& index() const { return end_.index; }
  TagSizes sizes() const {
    return with_parity(tag_sizes(source_->size(), header_size_, end_.envelope_size, end_.index), parity_);
  }
  /// The parity at the end of the file; nothing if there is none.
  const std::optional<ParityLayout>& parity() const { return parity_; }
  std::int64_t count() const { return pages_.layout().bricks(); }

  /// Position of the block of a brick in the file, and its size in bytes. Read the page of the brick.
  std::uint64_t start(std::int64_t brick) const;
  std::uint64_t block_bytes(std::int64_t brick) const;
  /// What the index says of the block of a brick: where it is, its size, and that of its activity.
  struct Block {
    std::uint64_t start = 0, bytes = 0, activity = 0;
  };
  /// Throws BrokenInput also if no brick can have this size: a false size takes no memory.
  Block block(std::int64_t brick) const;
  /// Where the page of the last brick ends.
  std::uint64_t end_of_pages() const { return pages_.start(pages_.layout().pages()); }
  /// What the index says of a brick. Reads both parts of its page.
  IndexEntry entry(std::int64_t brick) const;

  /// Tells a source that waits which bricks are read next, in any order. Reads their pages then.
  void will_read(std::span<const std::int64_t> bricks) const;
  /// Reads only the block of `brick`, and the checksum before it, to which the block is bound.
  BrickBytes read(std::int64_t brick) const;
  /// Gives the envelope block by block; false after the last one. This object must outlive the function.
  std::function<bool(std::vector<std::byte>& content)> envelope() const;
  /// The content of the first of these blocks; none without an envelope.
  std::vector<std::byte> beginning_of_envelope() const;
  /// The overview or volume of a member of the index: a file of its own, with the bytes of bytes_of(). Throws
  /// BrokenInput, also if it is not one of this file. REQUIRES: member.is_overview() or member.is_volume().
  std::shared_ptr<const TagBricks> nested(const Member& member) const;
  /// Throws BrokenInput if this file, the content of a member, has parts that such a file must not have.
  void require_parts_of(const Member& member) const;
  /// Its parameters, for which only its header is read. Throws as nested() does.
  CodingParameters parameters_of(const Member& member) const;
  /// Its name, from its header: "" if it has none.
  std::string name_of(const Member& member) const;
  /// Throws BrokenInput if the checksum of a member does not match.
  void check(const Member& member) const;

 private:
  struct Place {
    std::shared_ptr<const TagPages::Sizes> sizes;
    std::size_t number = 0;  ///< of the brick in its page
    std::uint64_t start() const { return sizes->starts[number]; }
    std::uint64_t bytes() const { return sizes->starts[number + 1] - start(); }
  };
  Place place(std::int64_t brick) const;
  /// Throws BrokenInput if these are not the parameters of such a file.
  void require_nested(const Member& member, const IndexedTag& nested) const;

  End end_;
  TagPages pages_;
};

/// The bricks of a file from one on. The file must outlive it.
class BricksInOrder : public BrickSource {
 public:
  explicit BricksInOrder(const TagBricks& file, std::int64_t first = 0) : file_(file), next_(first) {}
  const std::string& name() const override { return file_.name(); }
  bool read_brick(BrickBytes& brick) override {
    if (next_ == file_.count()) return false;
    brick = file_.read(next_++);
    return true;
  }

 private:
  const TagBricks& file_;
  std::int64_t next_;
};

/// The statistics of all volumes of a file together, such as the largest error in any of them; the index of the
/// file has those of volume 0 alone. Reads the index of each volume. Throws BrokenInput and WorldError.
Statistics statistics_of_all(const TagBricks& file);

/// Everything in a .tag file except its bricks and their entries in the index.
struct TagSummary {
  TagHeader header;
  TagIndex index;
  TagSizes sizes;
  std::vector<std::byte> beginning_of_envelope;  ///< see TagBricks
  std::optional<ParityLayout> parity;            ///< at the end of the file; nothing if there is none
  /// Of the overviews among the members of the index, in order; nothing for one whose header is damaged.
  std::vector<std::optional<CodingParameters>> overviews = {};
  std::vector<std::string> volume_names = {};  ///< of all volumes; empty if none has one
  /// Of all volumes; nothing if there are others than volume 0 whose indexes were not read: those of a pipe, and
  /// damaged ones.
  std::optional<Statistics> statistics = {};
};

/// The overview with this factor in a file. If there is none, throws a UsageError that names those that there are.
const Member& member_of_overview(const TagBricks& file, std::int64_t factor);
/// Throws UsageError, which says how many volumes the file has, if it has none with this number.
void require_volume(const IndexedTag& file, std::int64_t volume);
/// The volume with this number; null for volume 0. Throws UsageError that says how many there are.
const Member* member_of_volume(const TagBricks& file, std::int64_t volume);

/// The overview with this factor in a file, as the bytes of a file of its own. Throws BrokenInput, WorldError,
/// and UsageError that names the overviews if there is none with this factor.
std::shared_ptr<const ByteSource> overview_in(const TagBricks& file, std::int64_t factor);

/// The volume with this number, from 0 on, as the bytes of a file of its own: volume 0 is the file itself,
/// without its other volumes. Throws BrokenInput, WorldError, and UsageError that says how many there are.
std::shared_ptr<const ByteSource> volume_in(std::shared_ptr<const ByteSource> file, std::int64_t volume);
/// The same, read by its index.
std::shared_ptr<const TagBricks> volume_in(std::shared_ptr<const TagBricks> file, std::int64_t volume);

/// The number of volumes of a regular file. Reads only its header. Throws BrokenInput and WorldError.
int count_of_volumes(const std::string& path);

/// Reads the summary of a regular file without its bricks; a pipe ("-": the standard input) to its end, which
/// checks every checksum. Throws BrokenInput and WorldError.
TagSummary summary_of(const std::string& path);
/// That of a file that was read to its end.
TagSummary summary_of(const TagReader& reader);

}  // namespace tagrid
