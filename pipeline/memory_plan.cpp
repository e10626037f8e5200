#include "pipeline/memory_plan.h"

#include <algorithm>

namespace tagrid {

std::vector<BrickRows> EncodePlan::strips(const BrickGrid& bricks, const BrickRows& part) const {
  if (rows >= bricks.bricks(1)) return {part};
  std::vector<BrickRows> result;
  for (std::int64_t z = part.z_low; z < part.z_end; ++z)
    for (std::int64_t y = part.y_low; y < part.y_end; y += rows)
      result.push_back({y, std::min(y + rows, part.y_end), z, z + 1});
  return result;
}

EncodePlan plan_encoding(const CodingParameters& parameters, int threads) {
  return {EncodeBudget::generous(parameters, threads), parameters.bricks().bricks(1)};
}

DecodePlan plan_decoding(const CodingParameters& parameters, int threads) {
  return {DecodeBudget::generous(parameters, threads)};
}

}  // namespace tagrid
