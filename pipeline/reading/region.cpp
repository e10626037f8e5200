#include "pipeline/reading/region.h"

#include <array>
#include <cstring>

#include "stages/sample/sample_type.h"

namespace tagrid {
namespace {

// Copies rows of samples of a known size, so that the compiler can optimize the copy.
template <std::size_t size>
void copy_row(const std::byte* from, std::int64_t from_stride, std::byte* to, std::int64_t to_stride,
              std::int64_t count) {
  if (from_stride == size && to_stride == size) {
    std::memcpy(to, from, size * static_cast<std::size_t>(count));
    return;
  }
  for (std::int64_t i = 0; i < count; ++i) std::memcpy(to + i * to_stride, from + i * from_stride, size);
}

auto row_copier(std::size_t sample_size) {
  return sample_size == 1   ? copy_row<1>
         : sample_size == 2 ? copy_row<2>
         : sample_size == 4 ? copy_row<4>
                            : copy_row<8>;
}

}  // namespace

std::vector<std::int64_t> bricks_of(const Region& region, const BrickGrid& bricks) {
  // Each axis is handled separately: with a large step, some bricks have no sample.
  std::array<std::vector<std::int64_t>, 3> met;
  for (int axis = 0; axis < 3; ++axis)
    for (std::int64_t i = bricks.owner(region.box.low[axis]); i <= bricks.owner(region.box.high[axis]); ++i) {
      Index3 position;
      position[axis] = i;
      const Box numbers = region.numbers_in(bricks.owned_box(position));
      if (numbers.low[axis] <= numbers.high[axis]) met[static_cast<std::size_t>(axis)].push_back(i);
    }
  std::vector<std::int64_t> ids;
  ids.reserve(met[0].size() * met[1].size() * met[2].size());
  for (const std::int64_t z : met[2])
    for (const std::int64_t y : met[1])
      for (const std::int64_t x : met[0]) ids.push_back(bricks.id({x, y, z}));
  return ids;
}

std::int64_t slices_until(const Region& region, const Box& owned) {
  const std::int64_t last = region.sample(region.numbers_in(owned).high).z;
  return std::clamp(last - owned.low.z + 1, std::int64_t{1}, owned.size().z);
}

std::uint64_t copy_samples(const DecodedBrick& brick, const CodingParameters& parameters,
                           const Region& region, std::byte* out, const Strides& strides) {
  const BrickGrid bricks = parameters.bricks();
  const Box owned = bricks.owned_box(bricks.position(brick.id)), numbers = region.numbers_in(owned);
  if (numbers.empty()) return 0;
  const std::size_t size = size_of(parameters.type);
  const auto copy = row_copier(size);
  for (std::int64_t z = numbers.low.z; z <= numbers.high.z; ++z)
    for (std::int64_t y = numbers.low.y; y <= numbers.high.y; ++y) {
      const auto first = static_cast<std::size_t>(owned.offset(region.sample({numbers.low.x, y, z})));
      copy(brick.samples.data() + first * size, region.step.x * static_cast<std::int64_t>(size),
           out + numbers.low.x * strides[0] + y * strides[1] + z * strides[2], strides[0], numbers.size().x);
    }
  return static_cast<std::uint64_t>(numbers.count()) * size;
}

}  // namespace tagrid
