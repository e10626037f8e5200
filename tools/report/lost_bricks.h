// The lost parts of a damaged .tag file, for people and for scripts.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "stages/grid/brick_grid.h"

namespace tagrid {

/// A line for each run of bricks: their numbers, and their samples as a --region. Long lists are cut.
std::vector<std::string> lines_of_lost(const std::vector<BrickRun>& lost, const BrickGrid& bricks);

/// A list of boxes of samples: [{"low": [x0, y0, z0], "high": [x1, y1, z1]}, ...], half open as --region is.
nlohmann::ordered_json json_of_lost(const std::vector<BrickRun>& lost, const BrickGrid& bricks);

/// "3 of 192 bricks are lost".
std::string count_of_lost(const std::vector<BrickRun>& lost, const BrickGrid& bricks);

}  // namespace tagrid
