#include "io/tag/members.h"

#include "io/bytes/little_endian.h"

namespace tagrid {
namespace {

std::vector<std::byte> head_of(const Member& member) {
  FieldWriter head;
  head.put(member_marker);
  head.put(member.kind);
  head.put(member.factor);
  head.put(member.length);
  return std::move(head.bytes());
}

}  // namespace

Status parse_member_head(std::span<const std::byte> head, std::uint64_t offset, Member& member) {
  FieldReader fields(head);
  const auto marker = fields.get<std::uint32_t>();
  member.kind = fields.get<std::uint32_t>();
  member.factor = fields.get<std::uint32_t>();
  member.length = fields.get<std::uint64_t>();
  member.offset = offset;
  if (marker != member_marker) return Status::broken("no member begins here");
  if (member.length > std::uint64_t{1} << 62 || offset > std::uint64_t{1} << 62)
    return Status::broken("an impossible size");
  if (member.is_overview() && member.factor < 2)
    return Status::broken("an overview has an impossible factor");
  return {};
}

std::string Member::name() const {
  return (is_volume() ? "volume " : is_overview() ? "overview " : "member ") + std::to_string(factor);
}

MemberChecksum::MemberChecksum(const Member& member) { own_.add(head_of(member)); }

MemberWriter::MemberWriter(const Member& member, ByteSink& out) : own_(member), out_(out) {
  out_.write(head_of(member));
}

void MemberWriter::write(std::span<const std::byte> content) {
  own_.add(content);
  out_.write(content);
}

void MemberWriter::finish(std::uint64_t& checksum) {
  checksum = own_.chained(checksum);
  FieldWriter tail;
  tail.put(checksum);
  out_.write(tail.bytes());
}

std::vector<std::byte> serialize_members(const std::vector<Member>& members) {
  FieldWriter fields;
  for (const Member& member : members) {
    fields.put(member.kind);
    fields.put(member.factor);
    fields.put(member.offset);
    fields.put(member.length);
  }
  return std::move(fields.bytes());
}

Status parse_members(std::span<const std::byte> bytes, int volumes, std::vector<Member>& members) {
  const auto others = static_cast<std::uint32_t>(volumes - 1);
  const std::size_t count = bytes.size() / member_entry_size;
  if (bytes.size() % member_entry_size != 0 || count == 0 || count > most_members + others)
    return Status::broken("the table of members has an impossible size");
  FieldReader fields(bytes);
  members.resize(count);
  std::uint32_t coarsest = 1, found = 0;
  for (Member& member : members) {
    member.kind = fields.get<std::uint32_t>();
    member.factor = fields.get<std::uint32_t>();
    member.offset = fields.get<std::uint64_t>();
    member.length = fields.get<std::uint64_t>();
    if (member.is_volume() != (static_cast<std::uint32_t>(&member - members.data()) < others) ||
        (member.is_volume() && member.factor != ++found))
      return Status::broken("the members are not " + std::to_string(others) +
                            " further volumes in their order, and then others");
    if (!member.is_overview()) continue;
    if (member.factor <= coarsest) return Status::broken("the overviews do not become coarser");
    coarsest = member.factor;
  }
  if (found != others) return Status::broken("volumes are missing in the table of members");
  return {};
}

Status check_places(const std::vector<Member>& members, std::uint64_t begin, std::uint64_t end) {
  const auto wrong = [] { return Status::broken("the members do not add up to the size of the file"); };
  for (const Member& member : members) {
    const bool is_first = &member == &members.front();
    if (is_first ? member.offset < begin : member.offset != begin) return wrong();
    // Nothing overflows: no sum is larger than `end`.
    if (member.offset > end || member.length > end - member.offset ||
        member_frame_size > end - member.offset - member.length)
      return wrong();
    begin = member.end();
  }
  return members.empty() || begin == end ? Status() : wrong();
}

Index3 overview_dims(const Index3& dims, std::int64_t factor) {
  Index3 blocks;
  for (int axis = 0; axis < 3; ++axis) blocks[axis] = (dims[axis] - 1) / factor + 1;
  return blocks;
}

Status check_nested(const CodingParameters& file, const Member& member, const TagHeader& nested) {
  const CodingParameters& p = nested.parameters;
  if (member.is_volume())
    return nested.volumes == 1 && are_same(p, file)
               ? Status()
               : Status::broken("the volume has another size, type or bound than the file");
  if (nested.volumes != 1 || p.type != file.type || p.mode != FileMode::voxels ||
      p.grid != GridOrigin::derived || p.dims != overview_dims(file.dims, member.factor))
    return Status::broken("the overview is not one of this volume");
  return {};
}

}  // namespace tagrid
