// The bricks of a .tag file in any order, by its index.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "io/files/byte_source.h"
#include "io/tag/blocks.h"
#include "io/tag/header.h"
#include "io/tag/index.h"

namespace tagrid {

/// Reads a .tag file by its index: the header, the index and the footer at once, a brick when it is asked
/// for. All const functions may be called by several threads at once. Bytes that are wrong are BrokenInput,
/// which says where.
class TagBricks {
 public:
  /// Reads header, index and footer, and checks them.
  explicit TagBricks(std::shared_ptr<const ByteSource> source);

  const TagHeader& header() const { return header_; }
  const CodingParameters& parameters() const { return header_.parameters; }
  const TagIndex& index() const { return index_; }
  const std::string& name() const { return source_->name(); }
  TagSizes sizes() const { return tag_sizes(source_->size(), header_size_, index_); }
  std::int64_t count() const { return static_cast<std::int64_t>(starts_.size()) - 1; }

  /// Where the block of a brick begins in the file, and its bytes.
  std::uint64_t start(std::int64_t brick) const { return starts_[static_cast<std::size_t>(brick)]; }
  std::uint64_t block_bytes(std::int64_t brick) const { return start(brick + 1) - start(brick); }

  /// Reads the block of `brick`, and the checksum before it, to which the block is bound: nothing else.
  BrickBytes read(std::int64_t brick) const;

 private:
  [[noreturn]] void fail(const std::string& where, const std::string& what) const;
  std::vector<std::byte> bytes_at(std::uint64_t position, std::uint64_t size) const;
  void read_header();
  void read_end();

  std::shared_ptr<const ByteSource> source_;
  TagHeader header_;
  std::uint64_t header_size_ = 0, header_checksum_ = 0;
  TagIndex index_;
  std::vector<std::uint64_t> starts_;  ///< of every block, and where the last one ends
};

}  // namespace tagrid
