#include "tools/report/lost_bricks.h"

#include <fmt/format.h>

#include <numeric>

namespace tagrid {
namespace {

constexpr std::size_t most_lines = 50;

std::string region_of(const Box& box) {
  return fmt::format("{}:{},{}:{},{}:{}", box.low.x, box.high.x + 1, box.low.y, box.high.y + 1, box.low.z,
                     box.high.z + 1);
}

}  // namespace

std::vector<std::string> lines_of_lost(const std::vector<BrickRun>& lost, const BrickGrid& bricks) {
  std::vector<std::string> lines;
  for (const BrickRun& run : lost) {
    if (lines.size() == most_lines) {
      lines.push_back(fmt::format("and {} more places", lost.size() - most_lines));
      break;
    }
    std::string regions;
    for (const Box& box : boxes_of(run, bricks)) regions += (regions.empty() ? "" : " and ") + region_of(box);
    lines.push_back(
        run.first == run.last
            ? fmt::format("brick {} is damaged or missing: region {}", run.first, regions)
            : fmt::format("bricks {} to {} are damaged or missing: region {}", run.first, run.last, regions));
  }
  return lines;
}

nlohmann::ordered_json json_of_lost(const std::vector<BrickRun>& lost, const BrickGrid& bricks) {
  auto list = nlohmann::ordered_json::array();
  for (const BrickRun& run : lost)
    for (const Box& box : boxes_of(run, bricks))
      list.push_back({{"low", {box.low.x, box.low.y, box.low.z}},
                      {"high", {box.high.x + 1, box.high.y + 1, box.high.z + 1}}});
  return list;
}

std::string count_of_lost(const std::vector<BrickRun>& lost, const BrickGrid& bricks) {
  const std::int64_t count =
      std::accumulate(lost.begin(), lost.end(), std::int64_t{0},
                      [](std::int64_t sum, const BrickRun& run) { return sum + run.last - run.first + 1; });
  return fmt::format("{} of {} bricks {} lost", count, bricks.count(), count == 1 ? "is" : "are");
}

}  // namespace tagrid
