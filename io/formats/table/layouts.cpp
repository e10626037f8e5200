#include "io/formats/table/layouts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// The number of type T at byte `at`. REQUIRES: it is there.
template <class T>
T number_at(std::string_view bytes, std::size_t at, bool big_endian) {
  auto number =
      load_little_endian<std::make_unsigned_t<T>>(reinterpret_cast<const std::byte*>(bytes.data()) + at);
  return static_cast<T>(big_endian ? byte_swapped(number) : number);
}

std::optional<RawDescription> layout(const std::vector<std::int64_t>& sizes, const std::string& type,
                                     bool big_endian, std::uint64_t offset) {
  const auto known = sample_type_named(type);
  if (!known || sizes.empty() || sizes.size() > 3) return std::nullopt;
  const auto size = [&](std::size_t i) { return i < sizes.size() ? sizes[i] : 1; };
  const Index3 dims{size(0), size(1), size(2)};
  if (!sample_bytes(dims, *known)) return std::nullopt;
  return RawDescription{dims, *known, big_endian, offset};
}

/// `text` without blanks and line ends around it.
std::string without_space(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n"), end = text.find_last_not_of(" \t\r\n");
  return begin == text.npos ? "" : std::string(text.substr(begin, end + 1 - begin));
}

/// "name = value;" by names in lower case.
std::map<std::string, std::string> fields_of(std::string_view text) {
  std::map<std::string, std::string> fields;
  for (const std::string_view part : split(text, ';'))
    if (const std::size_t equal = part.find('='); equal != part.npos)
      fields.emplace(lower_case(without_space(part.substr(0, equal))), without_space(part.substr(equal + 1)));
  return fields;
}

std::optional<std::vector<std::int64_t>> whole_numbers(const auto& words) {
  std::vector<std::int64_t> numbers;
  for (const std::string_view word : words) {
    const auto number = whole_number_of(trimmed(word));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

std::string type_name(bool is_float, bool is_signed, std::int64_t bits) {
  return fmt::format("{}{}", is_float ? "float" : is_signed ? "int" : "uint", bits);
}

}  // namespace

std::optional<RawDescription> layout_of_npy(std::string_view b) {
  if (b.size() < 12) return std::nullopt;
  const bool is_old = b[6] == 1;
  const std::size_t begin = is_old ? 10 : 12;
  const std::size_t length =
      is_old ? number_at<std::uint16_t>(b, 8, false) : number_at<std::uint32_t>(b, 8, false);
  if (b.size() - begin < length) return std::nullopt;
  const std::string_view header = b.substr(begin, length);
  const auto after = [&](std::string_view key) {
    const std::size_t at = header.find(key);
    return at == header.npos ? std::string_view() : trimmed(header.substr(at + key.size()));
  };
  const std::string_view kind = after("'descr':"), order = after("'fortran_order':"),
                         shape = after("'shape':");
  const std::size_t end = shape.find(')');
  if (kind.size() < 4 || kind[0] != '\'' || !shape.starts_with('(') || end == shape.npos) return std::nullopt;
  const std::string_view type = kind.substr(1, kind.find('\'', 1) - 1);
  if (type.size() != 3 || std::string_view("uif").find(type[1]) == std::string_view::npos)
    return std::nullopt;
  std::vector<std::string_view> words = split(shape.substr(1, end - 1), ',');
  std::erase_if(words, [](std::string_view word) { return trimmed(word).empty(); });
  auto sizes = whole_numbers(words);
  if (!sizes) return std::nullopt;
  // The last axis of an array in C's order is the fastest one.
  if (!order.starts_with("True")) std::ranges::reverse(*sizes);
  return layout(*sizes, type_name(type[1] == 'f', type[1] == 'i', 8 * (type[2] - '0')), type[0] == '>',
                begin + length);
}

std::optional<RawDescription> layout_of_mrc(std::string_view b) {
  if (b.size() < 1024) return std::nullopt;
  const bool big_endian = b[212] == 0x11;
  const auto number = [&](std::size_t at) {
    return std::int64_t{number_at<std::int32_t>(b, at, big_endian)};
  };
  for (std::int64_t axis = 0; axis < 3; ++axis)
    if (const auto order = number(64 + 4 * static_cast<std::size_t>(axis)); order != 0 && order != axis + 1)
      return std::nullopt;
  const std::map<std::int64_t, std::string> types = {{1, "int16"}, {2, "float32"}, {6, "uint16"}};
  const auto type = types.find(number(12));
  if (type == types.end() || number(92) < 0) return std::nullopt;
  return layout({number(0), number(4), number(8)}, type->second, big_endian,
                1024 + static_cast<std::uint64_t>(number(92)));
}

std::optional<RawDescription> layout_of_mgh(std::string_view b) {
  if (b.size() < 284) return std::nullopt;
  const auto number = [&](std::size_t at) { return std::int64_t{number_at<std::int32_t>(b, at, true)}; };
  const std::map<std::int64_t, std::string> types = {
      {0, "uint8"}, {1, "int32"}, {3, "float32"}, {4, "int16"}};
  const auto type = types.find(number(20));
  if (type == types.end() || number(16) != 1) return std::nullopt;
  return layout({number(4), number(8), number(12)}, type->second, true, 284);
}

std::optional<RawDescription> layout_of_edf(std::string_view b) {
  const std::size_t end = b.find("}\n");
  if (!b.starts_with('{') || end == b.npos) return std::nullopt;
  const auto fields = fields_of(b.substr(1, end - 1));
  const auto text = [&](const std::string& name) {
    const auto found = fields.find(name);
    return found == fields.end() ? std::string() : lower_case(found->second);
  };
  if (!text("compression").empty() && text("compression") != "none") return std::nullopt;
  const std::map<std::string, std::string> types = {
      {"unsignedbyte", "uint8"},  {"signedbyte", "int8"},        {"unsignedshort", "uint16"},
      {"signedshort", "int16"},   {"unsignedinteger", "uint32"}, {"unsignedlong", "uint32"},
      {"signedinteger", "int32"}, {"signedlong", "int32"},       {"floatvalue", "float32"},
      {"float", "float32"},       {"real", "float32"},           {"doublevalue", "float64"},
      {"double", "float64"}};
  const auto type = types.find(text("datatype"));
  if (type == types.end()) return std::nullopt;
  std::vector<std::string> words;
  for (const char* name : {"dim_1", "dim_2", "dim_3"})
    if (!text(name).empty()) words.push_back(text(name));
  const auto sizes = whole_numbers(words);
  if (!sizes) return std::nullopt;
  return layout(*sizes, type->second, text("byteorder") == "highbytefirst", end + 2);
}

std::optional<RawDescription> layout_of_vff(std::string_view b) {
  const std::size_t end = b.find("\f\n");
  if (end == b.npos || end < 4) return std::nullopt;
  const auto fields = fields_of(b.substr(4, end - 4));
  const auto size = fields.find("size"), bits = fields.find("bits"), bands = fields.find("bands");
  if (size == fields.end() || bits == fields.end() || bits->second != "16") return std::nullopt;
  if (bands != fields.end() && bands->second != "1") return std::nullopt;
  const auto sizes = whole_numbers(words_of(size->second));
  if (!sizes) return std::nullopt;
  return layout(*sizes, "int16", true, end + 2);
}

std::optional<RawDescription> layout_of_fits(std::string_view b) {
  constexpr std::size_t card = 80, block = 2880;
  std::map<std::string, std::string> fields;
  std::size_t at = 0;
  for (; at + card <= b.size() && trimmed(b.substr(at, card)) != "END"; at += card)
    if (const std::string_view line = b.substr(at, card); line[8] == '=')
      fields.emplace(trimmed(line.substr(0, 8)), trimmed(line.substr(9, line.find('/', 9) - 9)));
  if (at + card > b.size()) return std::nullopt;
  const auto number = [&](const std::string& name, double otherwise) {
    const auto found = fields.find(name);
    return found == fields.end() ? otherwise : number_of(found->second).value_or(0);
  };
  if (number("BSCALE", 1) != 1 || number("BZERO", 0) != 0) return std::nullopt;
  const auto axes = static_cast<std::int64_t>(std::clamp(number("NAXIS", 0), 0.0, 9.0));
  std::vector<std::string> words;
  for (std::int64_t axis = 1; axis <= axes; ++axis) words.push_back(fields[fmt::format("NAXIS{}", axis)]);
  const auto sizes = whole_numbers(words);
  const auto bits = whole_number_of(fields["BITPIX"]);
  if (!sizes || !bits || *bits < -64 || *bits > 64) return std::nullopt;
  return layout(*sizes, type_name(*bits<0, *bits> 8, std::abs(*bits)), true,
                (at + card + block - 1) / block * block);
}

}  // namespace tagrid
