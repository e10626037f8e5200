#include "tools/formats/tiff/shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "io/text/text.h"

namespace tagrid {
namespace {

/// The numbers of a list, without its brackets; nothing if there are others.
std::optional<std::vector<std::int64_t>> numbers_in(std::string_view list) {
  std::vector<std::int64_t> numbers;
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    const auto number = whole_number_of(trimmed(list.substr(0, comma)));
    if (!number || *number < 1) return std::nullopt;
    numbers.push_back(*number);
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
  return numbers;
}

/// What follows `key` in a text; "" if it is not there.
std::string_view after(std::string_view text, std::string_view key) {
  const std::size_t at = text.find(key);
  return at == text.npos ? "" : text.substr(at + key.size());
}

}  // namespace

TiffShape shape_in(std::string_view description) {
  TiffShape shape;
  const std::string_view list = after(description, "\"shape\": [");
  const std::size_t end = list.find(']');
  if (!description.starts_with('{') || end == list.npos) return shape;
  const auto numbers = numbers_in(list.substr(0, end));
  if (!numbers) return shape;
  const std::string_view axes = after(description, "\"axes\": \"");
  const std::string_view names = axes.substr(0, axes.find('"'));
  std::size_t long_axes = 0;
  for (std::size_t i = 0; i + 2 < numbers->size(); ++i) {
    const std::int64_t size = (*numbers)[i];
    if (__builtin_mul_overflow(shape.images, static_cast<std::size_t>(size), &shape.images)) return {};
    if (size == 1) continue;
    // Z: slices; I and Q: of a sequence, and nobody knows.
    const bool is_other =
        names.size() == numbers->size() && std::string_view("ZIQ").find(names[i]) == names.npos;
    if (++long_axes > 1 || is_other) shape.is_of_slices = false;
    shape.text += (shape.text.empty() ? "" : " x ") + std::to_string(size);
  }
  if (!names.empty()) shape.text += fmt::format(" ({})", quoted(names));
  shape.is_truncated = description.find("\"truncated\": true") != description.npos;
  return shape;
}

}  // namespace tagrid
