#include "io/formats/zarr/reader/zip_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/formats/zarr/reader/store.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::uint32_t header_magic = 0x04034b50, member_magic = 0x02014b50, end_magic = 0x06054b50,
                        long_end_magic = 0x06064b50, locator_magic = 0x07064b50;
constexpr std::uint64_t header_size = 30, member_size = 46, end_size = 22, long_end_size = 56,
                        locator_size = 20;
constexpr std::uint16_t encrypted = 1;
constexpr std::uint16_t extra_of_long_sizes = 1;
constexpr std::uint64_t says_long = 0xffffffff, says_long_count = 0xffff;

BrokenInput broken_zip(const std::string& path, const std::string& why) {
  return BrokenInput("{}: zip file: {}", path, why);
}

/// A member as the table has it: the numbers that do not fit 32 bits are in an extra field.
struct Numbers {
  std::uint64_t size = 0, stored = 0, header = 0;

  /// False if such a field is missing.
  bool complete_from(std::span<const std::byte> bytes) {
    FieldReader extra(bytes);
    while (extra.left() >= 4) {
      const auto kind = extra.get<std::uint16_t>(), length = extra.get<std::uint16_t>();
      if (length > extra.left()) return false;
      FieldReader content(extra.get_bytes(length));
      if (kind != extra_of_long_sizes) continue;
      for (std::uint64_t* number : {&size, &stored, &header})
        if (*number == says_long) *number = content.get<std::uint64_t>();
      return !content.overrun();
    }
    return size != says_long && stored != says_long && header != says_long;
  }
};

}  // namespace

ZipFile::ZipFile(const std::string& path) : file_(std::make_shared<const FileSource>(path)) {
  read_members(find_table());
}

ZipFile::Table ZipFile::find_table() const {
  const std::uint64_t all = file_->size();
  constexpr std::uint64_t longest_comment = 0xffff;
  const std::uint64_t count = std::min(all, end_size + longest_comment);
  std::vector<std::byte> tail(count);
  file_->read_at(all - count, tail);
  // The comment after it may contain the magic number, too, but is as long as it says.
  std::optional<std::uint64_t> end;
  for (std::uint64_t at = count < end_size ? 0 : count - end_size + 1; at-- > 0 && !end;)
    if (load_little_endian<std::uint32_t>(&tail[at]) == end_magic &&
        load_little_endian<std::uint16_t>(&tail[at + 20]) == count - at - end_size)
      end = at;
  if (!end) throw broken_zip(file_->name(), "has no table of members at its end; it may be truncated");
  FieldReader fields{std::span(tail).subspan(*end + 4)};
  const auto disk = fields.get<std::uint16_t>(), disk_of_table = fields.get<std::uint16_t>();
  fields.get_bytes(2);
  Table table;
  table.members = fields.get<std::uint16_t>();
  table.size = fields.get<std::uint32_t>();
  table.position = fields.get<std::uint32_t>();
  const std::uint64_t end_position = all - count + *end;
  std::uint64_t table_end = end_position;
  const bool is_long =
      table.members == says_long_count || table.size == says_long || table.position == says_long;
  std::array<std::byte, locator_size> locator = {};
  if (is_long && end_position >= locator_size) file_->read_at(end_position - locator_size, locator);
  if (load_little_endian<std::uint32_t>(locator.data()) == locator_magic) {
    table_end = load_little_endian<std::uint64_t>(&locator[8]);
    if (table_end > end_position - locator_size || end_position - locator_size - table_end < long_end_size)
      throw broken_zip(file_->name(), "the end of its table is beyond the file");
    std::array<std::byte, long_end_size> long_end = {};
    file_->read_at(table_end, long_end);
    if (load_little_endian<std::uint32_t>(long_end.data()) != long_end_magic)
      throw broken_zip(file_->name(), "the end of its table is damaged");
    table.members = load_little_endian<std::uint64_t>(&long_end[32]);
    table.size = load_little_endian<std::uint64_t>(&long_end[40]);
    table.position = load_little_endian<std::uint64_t>(&long_end[48]);
  } else if (disk != 0 || disk_of_table != 0) {
    throw broken_zip(file_->name(), "is one of several parts; join them first");
  }
  if (table.position > table_end || table.size > table_end - table.position ||
      table.members > table.size / member_size)
    throw broken_zip(file_->name(), "its table of members does not fit the file");
  return table;
}

void ZipFile::read_members(const Table& table) {
  std::vector<std::byte> bytes(memory_size(table.size));
  file_->read_at(table.position, bytes);
  std::span<const std::byte> rest = bytes;
  for (std::uint64_t i = 0; i < table.members; ++i) {
    const auto require = [&](bool is_right) {
      if (!is_right) throw broken_zip(file_->name(), fmt::format("member {} of its table is damaged", i));
    };
    require(rest.size() >= member_size);
    FieldReader fields(rest);
    require(fields.get<std::uint32_t>() == member_magic);
    fields.get_bytes(4);
    const auto flags = fields.get<std::uint16_t>(), method = fields.get<std::uint16_t>();
    fields.get_bytes(4);
    Member member;
    member.crc = fields.get<std::uint32_t>();
    Numbers numbers;
    numbers.stored = fields.get<std::uint32_t>();
    numbers.size = fields.get<std::uint32_t>();
    const std::size_t name_size = fields.get<std::uint16_t>(), extra_size = fields.get<std::uint16_t>(),
                      comment_size = fields.get<std::uint16_t>();
    fields.get_bytes(8);
    numbers.header = fields.get<std::uint32_t>();
    require(rest.size() - member_size >= name_size + extra_size + comment_size);
    const std::string name(reinterpret_cast<const char*>(rest.data()) + member_size, name_size);
    require(numbers.complete_from(rest.subspan(member_size + name_size, extra_size)));
    rest = rest.subspan(member_size + name_size + extra_size + comment_size);
    if (name.ends_with('/')) continue;  // a folder
    if (!is_relative_name(name) || name.find('\\') != name.npos)
      throw broken_zip(file_->name(),
                       fmt::format("the name {} of a member leads elsewhere", tagrid::quoted(name)));
    member.is_plain = method == 0 && (flags & encrypted) == 0;
    require(!member.is_plain || numbers.stored == numbers.size);
    member.header = numbers.header;
    member.size = numbers.stored;
    if (!members_.emplace(name, member).second)
      throw broken_zip(file_->name(), fmt::format("has two members of the name {}", tagrid::quoted(name)));
  }
}

const ZipFile::Member* ZipFile::member(const std::string& name) const {
  const auto found = members_.find(name);
  return found == members_.end() ? nullptr : &found->second;
}

std::unique_ptr<ByteSource> ZipFile::open(const std::string& name, const Member& member) const {
  if (!member.is_plain)
    throw broken_zip(file_->name(),
                     fmt::format("{} is compressed or encrypted, but must be stored as it is (RFC-9); unpack "
                                 "the file, or pack it again without compression: zip -0",
                                 tagrid::quoted(name)));
  const auto require = [&](bool is_right) {
    if (!is_right)
      throw broken_zip(file_->name(),
                       fmt::format("{} does not fit the table of members", tagrid::quoted(name)));
  };
  const std::uint64_t all = file_->size();
  require(member.header <= all && all - member.header >= header_size);
  std::array<std::byte, header_size> header = {};
  file_->read_at(member.header, header);
  const std::uint64_t name_size = load_little_endian<std::uint16_t>(&header[26]),
                      extra_size = load_little_endian<std::uint16_t>(&header[28]);
  require(load_little_endian<std::uint32_t>(header.data()) == header_magic && name_size == name.size());
  const std::uint64_t begin = header_size + name_size + extra_size;
  require(all - member.header >= begin && all - member.header - begin >= member.size);
  std::string own(name.size(), '\0');
  file_->read_at(member.header + header_size, std::as_writable_bytes(std::span(own)));
  require(own == name);
  return std::make_unique<PartOfSource>(file_, member.header + begin, member.size,
                                        fmt::format("{}: {}", file_->name(), printable(name)));
}

}  // namespace tagrid
