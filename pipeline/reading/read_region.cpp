#include "pipeline/reading/read_region.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <mutex>
#include <utility>

#include "io/errors/errors.h"
#include "pipeline/decode/graph.h"
#include "pipeline/threads/threads.h"

namespace tagrid {
namespace {

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
    } catch (const BrokenInput& broken) {
      if (!blocks.accepts || is_newer_format(broken)) throw;
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
