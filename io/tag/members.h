// Members of a .tag file: other content that is nested in it, such as overviews. docs/dev/format.md specifies them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/bytes/checksum.h"
#include "io/files/byte_sink.h"
#include "io/tag/header.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/status.h"

namespace tagrid {

/// The first field of a member, where a brick has its length, which never is that large: see largest_body().
inline constexpr std::uint32_t member_marker = 0xFFFFFFFF;
/// Bytes of a member before its content: that field, kind, factor and length.
inline constexpr std::uint64_t member_head_size = 4 + 4 + 4 + 8;
/// Bytes of a member besides its content: the head and the checksum.
inline constexpr std::uint64_t member_frame_size = member_head_size + 8;
/// A file has no more members besides its volumes.
inline constexpr std::size_t most_members = 64;

/// The kinds of members. Numbers are part of the file format: never renumber. A reader skips others.
inline constexpr std::uint32_t overview_kind = 1, volume_kind = 2;

/// Where a member is in its file.
struct Member {
  std::uint32_t kind = 0;
  /// Of an overview: the edge of a block, in samples. Of a volume: its number, from 1 on.
  std::uint32_t factor = 0;
  std::uint64_t offset = 0;  ///< of its marker
  std::uint64_t length = 0;  ///< of its content

  std::uint64_t content() const { return offset + member_head_size; }
  std::uint64_t end() const { return offset + member_frame_size + length; }
  bool is_overview() const { return kind == overview_kind; }
  bool is_volume() const { return kind == volume_kind; }
  bool is_unknown() const { return !is_overview() && !is_volume(); }
  std::uint64_t bytes() const { return member_frame_size + length; }
  /// For messages: "overview 4".
  std::string name() const;
  friend bool operator==(const Member&, const Member&) = default;
};

/// Reads the head of a member that begins at `offset`. Broken if it is not one.
Status parse_member_head(std::span<const std::byte> head, std::uint64_t offset, Member& member);

/// The checksum of a member's bytes, which arrive part by part: those of its head first. See chained_checksum().
class MemberChecksum {
 public:
  explicit MemberChecksum(const Member& member);
  void add(std::span<const std::byte> content) { own_.add(content); }
  std::uint64_t chained(std::uint64_t before) const { return chained_checksum(own_.value(), before); }

 private:
  RunningChecksum own_;
};

/// Writes a member of a file: its head, the content that write() gets part by part, and its checksum.
class MemberWriter : public ByteSink {
 public:
  /// Writes the head. `out` must outlive this object.
  MemberWriter(const Member& member, ByteSink& out);
  void write(std::span<const std::byte> content) override;
  /// `checksum` is that of the last block of the file; it is continued. REQUIRES: all of the content was written.
  void finish(std::uint64_t& checksum);

 private:
  MemberChecksum own_;
  ByteSink& out_;
};

/// The table of the members of a file, for the directory.
std::vector<std::byte> serialize_members(const std::vector<Member>& members);
/// Bytes of an entry of the table.
inline constexpr std::uint64_t member_entry_size = 4 + 4 + 8 + 8;
/// Reads the table of a file with so many volumes. It is all of `bytes` and has an entry at least.
Status parse_members(std::span<const std::byte> bytes, int volumes, std::vector<Member>& members);
/// Checks that the members lie one after the other, from byte `begin` or later to byte `end`.
Status check_places(const std::vector<Member>& members, std::uint64_t begin, std::uint64_t end);

/// The samples of an overview: blocks of `factor` samples along each axis, the last ones perhaps of fewer.
Index3 overview_dims(const Index3& dims, std::int64_t factor);
/// Checks that `nested` can be the header of a member of a file with these parameters: of an overview or a
/// volume.
Status check_nested(const CodingParameters& file, const Member& member, const TagHeader& nested);

}  // namespace tagrid
