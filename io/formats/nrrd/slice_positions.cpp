#include "io/formats/nrrd/slice_positions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "io/formats/nrrd/geometry.h"
#include "io/text/text.h"

namespace tagrid {

std::vector<std::string_view> positions_in(std::string_view list) {
  std::vector<std::string_view> positions;
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(';'), list.size());
    positions.push_back(trimmed(list.substr(0, end)));
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return positions;
}

std::vector<double> slice_distances(std::string_view nrrd_fields, std::int64_t slices) {
  const std::string list = text_of_key(nrrd_fields, slice_positions_key);
  std::vector<std::array<double, 3>> places;
  for (const std::string_view position : positions_in(list)) {
    const auto words = words_of(position);
    std::array<double, 3> place = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto number = words.size() == 3 ? number_of(words[axis]) : std::nullopt;
      if (!number || !std::isfinite(*number)) return {};
      place[axis] = *number;
    }
    places.push_back(place);
  }
  if (static_cast<std::int64_t>(places.size()) != slices) return {};
  std::vector<double> distances;
  const auto& first = places.front();
  for (const auto& place : places)
    distances.push_back(std::hypot(place[0] - first[0], place[1] - first[1], place[2] - first[2]));
  return distances;
}

}  // namespace tagrid
