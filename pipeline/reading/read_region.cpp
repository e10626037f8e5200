#include "pipeline/reading/read_region.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <mutex>
#include <utility>

#include "io/errors/errors.h"
#include "pipeline/decode/graph.h"
#include "pipeline/memory/plan.h"
#include "pipeline/threads/threads.h"

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

// The brick of a block, decoded as far as the region needs it.
DecodedBrick decode_for(const Region& region, const BrickBytes& block, const CodingParameters& parameters,
                        const std::string& name) {
  const BrickGrid bricks = parameters.bricks();
  const std::int64_t slices = slices_until(region, bricks.owned_box(bricks.position(block.id)));
  return decode_block(block, parameters, name, Wanted::samples, slices);
}

// Calls work(0 .. count - 1) on some threads, in any order.
template <class Work>
void for_each_number(std::size_t count, int threads, Work work) {
  const auto needed = static_cast<int>(std::clamp<std::size_t>(count, 1, static_cast<std::size_t>(threads)));
  Threads(needed).run([&] { oneapi::tbb::parallel_for(std::size_t{0}, count, work); });
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

int threads_for_reading(const CodingParameters& parameters, const Resources& resources) {
  return threads_within(resources, "reading a part of the volume",
                        [&](int threads) { return memory_of_reading(parameters, threads); });
}

void decode_bricks(const BlocksInOrder& blocks, const CodingParameters& parameters, const Region& region,
                   std::byte* out, const Strides& strides, int threads) {
  CodingParameters stored = parameters;
  if (blocks.change_samples) stored.type = blocks.type;
  const auto store = [&](DecodedBrick brick) {
    if (blocks.change_samples) blocks.change_samples(brick);
    copy_samples(brick, stored, region, out, strides);
  };
  const std::vector<std::int64_t> ids = bricks_of(region, parameters.bricks());
  if (blocks.will_read) blocks.will_read(ids);
  std::mutex reading;
  auto id = ids.begin();
  // A free thread takes the next block, whatever number it was called with, because blocks are read in order.
  for_each_number(ids.size(), threads, [&](std::size_t) {
    std::optional<BrickBytes> block;
    {
      const std::lock_guard lock(reading);
      block = blocks.next(*id);
      ++id;
    }
    if (!block) return;
    try {
      DecodedBrick brick = blocks.accepts ? decode_block(*block, parameters, blocks.name, Wanted::samples)
                                          : decode_for(region, *block, parameters, blocks.name);
      if (!blocks.accepts || blocks.accepts(brick)) return store(std::move(brick));
    } catch (const BrokenInput&) {
      if (!blocks.accepts) throw;
    }
    const std::lock_guard lock(reading);
    blocks.broken(block->id);
  });
}

void read_region(const TagBricks& file, const Region& region, std::byte* out, const Strides& strides,
                 int threads, const Progress& progress) {
  assert(file.parameters().domain().volume().contains(region.box));
  const CodingParameters& parameters = file.parameters();
  const Index3 shape = region.shape();
  const std::uint64_t total =
      static_cast<std::uint64_t>(shape.x * shape.y * shape.z) * size_of(parameters.type);
  std::mutex telling;
  std::uint64_t done = 0;
  const std::vector<std::int64_t> ids = bricks_of(region, parameters.bricks());
  file.will_read(ids);
  for_each_number(ids.size(), threads, [&](std::size_t i) {
    const DecodedBrick brick = decode_for(region, file.read(ids[i]), parameters, file.name());
    const std::uint64_t bytes = copy_samples(brick, parameters, region, out, strides);
    if (!progress) return;
    const std::lock_guard lock(telling);
    progress(done += bytes, total);
  });
}

}  // namespace tagrid
