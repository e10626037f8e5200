#include "io/formats/nrrd/lost_places.h"

#include <fmt/format.h>

#include "io/formats/nrrd/spaces.h"
#include "io/text/text.h"
#include "io/volume/lengths.h"

namespace tagrid {

std::vector<std::string> lost_places(const Geometry& geometry, const OneSpaceFormat& format) {
  std::vector<std::string> lost;
  const CommonUnit unit = common_unit(geometry);
  if (std::string mixed = lost_by_mixed_units(geometry); !mixed.empty())
    lost.push_back(std::move(mixed));
  else if (!unit.name.empty() && !unit.is_known)
    lost.push_back(fmt::format("{} does not know the unit {}; {}", format.name,
                               quoted(std::string_view(unit.name)), format.unknown_unit));
  if (has_unknown_spacing(geometry))
    lost.push_back(fmt::format("{} cannot record that a spacing is unknown; 1 is written", format.name));
  if ((geometry.has_directions || geometry.has_origin) && !signs_of_space(geometry.space))
    lost.push_back(fmt::format(
        "{} means {}; the space of the volume is {}, and its positions are written as they are", format.name,
        format.space, geometry.space.empty() ? "not known" : quoted(std::string_view(geometry.space))));
  return lost;
}

}  // namespace tagrid
