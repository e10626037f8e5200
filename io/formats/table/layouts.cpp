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

std::optional<RawDescription> layout_of_mgh(std::string_view b) {
  if (b.size() < 284) return std::nullopt;
  const auto number = [&](std::size_t at) { return std::int64_t{number_at<std::int32_t>(b, at, true)}; };
  const std::map<std::int64_t, std::string> types = {
      {0, "uint8"}, {1, "int32"}, {3, "float32"}, {4, "int16"}};
  const auto type = types.find(number(20));
  if (type == types.end() || number(16) != 1) return std::nullopt;
  return layout({number(4), number(8), number(12)}, type->second, true, 284);
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
