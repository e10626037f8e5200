#include "tools/options/wanted_region.h"

#include <fmt/format.h>

#include <tuple>

#include "io/errors/errors.h"
#include "tools/options/numbers.h"

namespace tagrid {

void add_region_option(CLI::App& command, std::string& region, const std::string& description) {
  command
      .add_option("--region", region,
                  description + ": x0 <= x < x1, likewise y and z; an omitted end is that of the volume")
      ->option_text("x0:x1,y0:y1,z0:z1");
}

WantedRegion wanted_region(const std::string& region) {
  WantedRegion wanted;
  if (region.empty()) return wanted;
  const auto ranges = three_ranges(region);
  if (!ranges)
    throw UsageError(fmt::format(
        "--region {}: must be x0:x1,y0:y1,z0:z1 with whole numbers; an end may be left out", region));
  for (std::size_t axis = 0; axis < 3; ++axis)
    std::tie(wanted.low[axis], wanted.high[axis]) = (*ranges)[axis];
  return wanted;
}

}  // namespace tagrid
