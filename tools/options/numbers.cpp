#include "tools/options/numbers.h"

#include <algorithm>
#include <cmath>

namespace tagrid {
namespace {

/// The parts of "a,b,c"; nothing if there are not exactly three.
std::optional<std::array<std::string_view, 3>> three_parts(std::string_view text) {
  std::array<std::string_view, 3> parts;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t comma = text.find(',');
    if ((comma == text.npos) != (i == 2)) return std::nullopt;
    parts[i] = text.substr(0, comma);
    if (i < 2) text.remove_prefix(comma + 1);
  }
  return parts;
}

}  // namespace

std::optional<double> finite_number(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number)) return std::nullopt;
  return number + 0.0;  // -0 becomes 0
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
  const auto parts = three_parts(text);
  if (!parts) return std::nullopt;
  Index3 sizes;
  for (int axis = 0; axis < 3; ++axis) {
    const auto size = whole_number<std::int64_t>((*parts)[static_cast<std::size_t>(axis)]);
    if (!size || *size < 1 || *size > most) return std::nullopt;
    sizes[axis] = *size;
  }
  return sizes;
}

std::optional<std::array<double, 3>> three_distances(std::string_view text) {
  const auto parts = three_parts(text);
  if (!parts) return std::nullopt;
  std::array<double, 3> distances = {};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto distance = finite_number((*parts)[axis]);
    if (!distance || *distance <= 0 || *distance > 1e300) return std::nullopt;
    distances[axis] = *distance;
  }
  return distances;
}

std::optional<std::array<IndexRange, 3>> three_ranges(std::string_view text) {
  const auto parts = three_parts(text);
  if (!parts) return std::nullopt;
  std::array<IndexRange, 3> ranges;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string_view part = (*parts)[axis];
    const std::size_t colon = part.find(':');
    if (colon == part.npos) return std::nullopt;
    const auto end = [](std::string_view digits, std::optional<std::int64_t>& number) {
      if (!digits.empty()) number = whole_number<std::int64_t>(digits);
      return digits.empty() || number.has_value();
    };
    if (!end(part.substr(0, colon), ranges[axis].first) || !end(part.substr(colon + 1), ranges[axis].second))
      return std::nullopt;
  }
  return ranges;
}

std::optional<std::pair<double, double>> value_range(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == text.npos) return std::nullopt;
  const auto low = finite_number(text.substr(0, colon)), high = finite_number(text.substr(colon + 1));
  if (!low || !high) return std::nullopt;
  return std::pair(*low, *high);
}

}  // namespace tagrid
