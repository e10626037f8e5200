#include "pipeline/parts/partition.h"

#include <algorithm>

namespace tagrid {
namespace {

// The lattice points that a row of bricks adds: about as many as its samples, and within 64 bits.
std::int64_t row_samples(const BrickGrid& bricks) {
  const std::int64_t edge = bricks.length();
  const Index3& dims = bricks.domain.dims;
  return dims.x * std::min(edge, dims.y) * std::min(edge, dims.z);
}

// Cuts `count` into the smallest number of stretches of at most `most`, as equal as possible.
template <class Add>
void cut(std::int64_t count, std::int64_t most, Add add) {
  const std::int64_t stretches = (count + most - 1) / most;
  for (std::int64_t i = 0; i < stretches; ++i) add(count * i / stretches, count * (i + 1) / stretches);
}

}  // namespace

std::vector<BrickRows> parts_of(const BrickGrid& bricks) {
  constexpr std::int64_t wanted_parts = 16;
  const std::int64_t rows = bricks.bricks(1), layers = bricks.bricks(2);
  const std::int64_t row = row_samples(bricks);
  const std::int64_t most_rows =
      std::max<std::int64_t>(1, std::min(largest_part / row, rows * layers / wanted_parts));
  std::vector<BrickRows> parts;
  if (most_rows >= rows) {
    cut(layers, most_rows / rows, [&](std::int64_t low, std::int64_t end) {
      parts.push_back({0, rows, low, end});
    });
    return parts;
  }
  for (std::int64_t z = 0; z < layers; ++z)
    cut(rows, most_rows, [&](std::int64_t low, std::int64_t end) { parts.push_back({low, end, z, z + 1}); });
  return parts;
}

}  // namespace tagrid
