#include "io/formats/nrrd/axis_ends.h"

#include <cmath>
#include <map>
#include <string_view>
#include <vector>

#include "io/formats/nrrd/geometry.h"
#include "io/formats/nrrd/line.h"
#include "io/text/text.h"

namespace tagrid {

std::string with_spacing_of_ends(const std::string& nrrd_fields, const Index3& dims) {
  std::map<std::string_view, std::vector<std::string_view>> words;
  std::string others;  // all lines but the spacings
  for (std::string_view rest = nrrd_fields; !rest.empty();) {
    const std::string_view line = take_line(rest);
    const NrrdLine parsed = parse_nrrd_line(line);
    words[parsed.field] = words_of(parsed.value);
    if (parsed.field != "spacings") others.append(line).append("\n");
  }
  const auto &mins = words["axis mins"], &maxs = words["axis maxs"], &centers = words["centers"];
  const Geometry geometry = geometry_of(nrrd_fields);
  if (mins.size() != 3 || maxs.size() != 3 || geometry.has_directions) return nrrd_fields;
  std::array<double, 3> spacing = geometry.spacing;
  bool has_more = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!std::isnan(spacing[axis])) continue;
    const auto low = number_of(mins[axis]), high = number_of(maxs[axis]);
    const bool is_node = centers.size() == 3 && lower_case(centers[axis]) == "node";
    const auto steps = dims[static_cast<int>(axis)] - (is_node ? 1 : 0);
    if (!low || !high || steps == 0) continue;
    const double step = (*high - *low) / static_cast<double>(steps);
    if (!std::isfinite(step) || step == 0) continue;
    spacing[axis] = step;
    has_more = true;
  }
  return has_more ? others + spacings_line(spacing) : nrrd_fields;
}

}  // namespace tagrid
