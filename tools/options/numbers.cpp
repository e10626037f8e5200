#include "tools/options/numbers.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "io/metadata/lengths.h"

namespace tagrid {
namespace {

/// What read() makes of the parts of "a,b,c"; nothing unless there are three and it can read all of them.
template <class Part, class Read>
std::optional<std::array<Part, 3>> three_parts(std::string_view text, Read read) {
  const std::vector<std::string_view> given = split(text, ',');
  if (given.size() != 3) return std::nullopt;
  std::array<Part, 3> parts;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::optional<Part> part = read(given[i]);
    if (!part) return std::nullopt;
    parts[i] = *part;
  }
  return parts;
}

}  // namespace

std::optional<double> finite_number(std::string_view text) {
  const auto number = number_of(text);
  if (!number || !std::isfinite(*number)) return std::nullopt;
  return *number + 0.0;  // -0 becomes 0
}

std::optional<std::uint64_t> byte_count(std::string_view text) {
  constexpr std::string_view units = "KMGT", small_units = "kmgt";
  const auto unit = text.find_last_not_of("+.0123456789iB");
  if (unit == text.npos) return whole_number<std::uint64_t>(text);
  const std::string_view rest = text.substr(unit + 1);
  const auto power = std::min(units.find(text[unit]), small_units.find(text[unit]));
  if (power == units.npos || (!rest.empty() && rest != "B" && rest != "iB")) return std::nullopt;
  const int shift = 10 * (static_cast<int>(power) + 1);
  const std::string_view digits = text.substr(0, unit);
  if (const auto number = whole_number<std::uint64_t>(digits)) {
    if (*number << shift >> shift != *number) return std::nullopt;
    return *number << shift;
  }
  // With a point: what is left below a byte is cut off.
  const bool plain = digits.find_first_not_of("+.0123456789") == digits.npos;
  const auto number = plain ? finite_number(digits) : std::nullopt;
  if (!number || *number < 0) return std::nullopt;
  const double bytes = std::ldexp(*number, shift);
  if (bytes >= 0x1p64) return std::nullopt;
  return static_cast<std::uint64_t>(bytes);
}

std::optional<Index3> three_sizes(std::string_view text) {
  constexpr std::int64_t most = std::int64_t{1} << 31;
  const auto sizes = three_parts<std::int64_t>(text, [](std::string_view part) {
    const auto size = whole_number<std::int64_t>(part);
    return size && *size >= 1 && *size <= most ? size : std::nullopt;
  });
  return sizes ? std::optional(Index3{(*sizes)[0], (*sizes)[1], (*sizes)[2]}) : std::nullopt;
}

std::optional<GivenSpacing> given_spacing(std::string_view text) {
  const std::vector<std::string_view> parts = split(text, ',');
  if (parts.size() != 1 && parts.size() != 3) return std::nullopt;
  GivenSpacing given;
  std::vector<std::string> units;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t end = parts[i].find_last_of("0123456789.") + 1;
    const auto distance = finite_number(parts[i].substr(0, end));
    if (!distance || !(*distance > 0 && *distance <= 1e300)) return std::nullopt;
    given.distances[i] = *distance;
    if (const std::string_view name = trimmed(parts[i].substr(end)); !name.empty()) {
      const auto unit = length_unit(name);
      if (!unit) return std::nullopt;
      units.emplace_back(unit->name);
    } else if (!units.empty()) {
      return std::nullopt;  // A unit in front may or may not be that of the others.
    }
  }
  if (units.size() == 2 || std::ranges::adjacent_find(units, std::ranges::not_equal_to()) != units.end())
    return std::nullopt;
  if (parts.size() == 1) given.distances.fill(given.distances[0]);
  if (!units.empty()) given.unit = units.front();
  return given;
}

std::optional<std::array<IndexRange, 3>> three_ranges(std::string_view text) {
  return three_parts<IndexRange>(text, [](std::string_view part) -> std::optional<IndexRange> {
    const std::size_t colon = part.find(':');
    if (colon == part.npos) return std::nullopt;
    const std::string_view first = part.substr(0, colon), end = part.substr(colon + 1);
    const IndexRange range(whole_number<std::int64_t>(first), whole_number<std::int64_t>(end));
    const bool is_good = (first.empty() || range.first) && (end.empty() || range.second);
    return is_good ? std::optional(range) : std::nullopt;
  });
}

std::optional<std::pair<double, double>> value_range(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == text.npos) return std::nullopt;
  const auto low = finite_number(text.substr(0, colon)), high = finite_number(text.substr(colon + 1));
  if (!low || !high) return std::nullopt;
  return std::pair(*low, *high);
}

}  // namespace tagrid
