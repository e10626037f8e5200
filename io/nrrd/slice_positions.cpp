#include "io/nrrd/slice_positions.h"

#include <algorithm>

#include "io/files/text.h"

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

}  // namespace tagrid
