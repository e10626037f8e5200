#include "io/formats/tiff/reader/directories.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "io/bytes/memory_size.h"

namespace tagrid {
namespace {

/// Of numbers and fields that are read at once.
constexpr std::uint64_t most_values = std::uint64_t{1} << 20;
/// Bytes of a value, by the number of its type.
constexpr std::array<std::uint8_t, 19> bytes_of_type = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4,
                                                        8, 4, 8, 4, 0, 0, 8, 8, 8};

}  // namespace

std::size_t TiffField::value_bytes() const { return type < bytes_of_type.size() ? bytes_of_type[type] : 0; }
std::uint64_t TiffField::bytes() const { return count * value_bytes(); }

TiffDirectories::TiffDirectories(const std::string& path) : file_(path) {
  const std::string begin = bytes(0, 4);
  if (begin.substr(0, 2) != "II" && begin.substr(0, 2) != "MM")
    throw NoPlainForm{"it does not begin as TIFF"};
  layout_.big_endian = begin[0] == 'M';
  constexpr std::uint64_t big_version = 43;
  layout_.is_big = number(2, 2) == big_version;
  first_ = number(layout_.is_big ? 8 : 4, layout_.place_bytes());
}

std::string TiffDirectories::bytes(std::uint64_t position, std::uint64_t count) const {
  if (position > size() || count > size() - position) throw NoPlainForm{"a field lies beyond its end"};
  std::string bytes(memory_size(count), '\0');
  file_.read_at(position, std::as_writable_bytes(std::span(bytes)));
  return bytes;
}

std::uint64_t TiffDirectories::number(std::uint64_t position, std::size_t count) const {
  const std::string found = bytes(position, count);
  return layout_.number(std::as_bytes(std::span(found)));
}

TiffDirectory TiffDirectories::at(std::uint64_t place) const {
  const std::size_t place_bytes = layout_.place_bytes(), count_bytes = layout_.is_big ? 8 : 2;
  const std::size_t entry = 4 + 2 * place_bytes;
  const std::uint64_t count = number(place, count_bytes);
  if (count > most_values) throw NoPlainForm{fmt::format("a directory has {} fields", count)};
  const std::string entries = bytes(place + count_bytes, count * entry + place_bytes);
  TiffDirectory directory;
  const auto number_at = [&](std::uint64_t position, std::size_t size) {
    return layout_.number(std::as_bytes(std::span(entries)).subspan(position, size));
  };
  for (std::uint64_t i = 0; i < count; ++i) {
    TiffField field;
    field.tag = static_cast<std::uint16_t>(number_at(i * entry, 2));
    field.type = static_cast<std::uint16_t>(number_at(i * entry + 2, 2));
    field.count = number_at(i * entry + 4, place_bytes);
    if (field.value_bytes() == 0)
      throw NoPlainForm{fmt::format("tag {} has values of the unknown type {}", field.tag, field.type)};
    if (field.count > size()) throw NoPlainForm{fmt::format("tag {} lies beyond its end", field.tag)};
    const std::uint64_t in_entry = i * entry + 4 + place_bytes;
    field.at =
        field.bytes() <= place_bytes ? place + count_bytes + in_entry : number_at(in_entry, place_bytes);
    if (field.at > size() || field.bytes() > size() - field.at)
      throw NoPlainForm{fmt::format("tag {} lies beyond its end", field.tag)};
    directory.fields.push_back(field);
  }
  directory.next = number_at(count * entry, place_bytes);
  return directory;
}

std::vector<std::uint64_t> TiffDirectories::numbers(const TiffField& field) const {
  const std::size_t size = field.value_bytes();
  if (field.count > most_values)
    throw NoPlainForm{fmt::format("tag {} has {} values", field.tag, field.count)};
  const std::string values = bytes(field.at, field.bytes());
  std::vector<std::uint64_t> numbers;
  for (std::uint64_t i = 0; i < field.count; ++i)
    numbers.push_back(layout_.number(std::as_bytes(std::span(values)).subspan(i * size, size)));
  return numbers;
}

std::uint64_t TiffDirectories::number_of(const TiffDirectory& directory, std::uint16_t tag,
                                         std::uint64_t otherwise) const {
  const auto field = std::ranges::find(directory.fields, tag, &TiffField::tag);
  return field == directory.fields.end() || field->count != 1 ? otherwise : numbers(*field).front();
}

}  // namespace tagrid
