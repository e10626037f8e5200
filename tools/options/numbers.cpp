#include "tools/options/numbers.h"

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
  int shift = 0;
  if (text.ends_with("KiB") || text.ends_with("MiB") || text.ends_with("GiB") || text.ends_with("TiB"))
    text.remove_suffix(2);
  if (text.ends_with('K')) shift = 10;
  if (text.ends_with('M')) shift = 20;
  if (text.ends_with('G')) shift = 30;
  if (text.ends_with('T')) shift = 40;
  if (shift > 0) text.remove_suffix(1);
  const auto number = whole_number<std::uint64_t>(text);
  if (!number || *number << shift >> shift != *number) return std::nullopt;
  return *number << shift;
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
