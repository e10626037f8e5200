// Builds a part of the mesh from the bricks that it needs.
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "io/files/errors.h"
#include "pipeline/decode/block.h"
#include "pipeline/memory/of_bricks.h"
#include "pipeline/mesh/mesh_bricks.h"

namespace tagrid {
namespace {

// Decoded bricks of one layer: those of the part and, if samples are needed, those below them.
class Layer {
 public:
  Layer() = default;
  Layer(const TagBricks& file, const Box& positions, const Box& meshed, oneapi::tbb::task_arena& arena)
      : positions_(positions), bricks_(static_cast<std::size_t>(positions.count())) {
    const BrickGrid grid = file.parameters().bricks();
    arena.execute([&] {
      oneapi::tbb::parallel_for(std::int64_t{0}, positions.count(), [&](std::int64_t i) {
        const Index3 size = positions_.size();
        const Index3 position = positions_.low + Index3{i % size.x, i / size.x, 0};
        const BrickBytes block = file.read(grid.id(position));
        const Wanted wanted = meshed.contains(position) ? Wanted::samples_and_grid : Wanted::samples;
        bricks_[static_cast<std::size_t>(i)] = decode_block(block, file.parameters(), file.name(), wanted);
      });
    });
  }
  const DecodedBrick& at(Index3 position) const {
    return bricks_[static_cast<std::size_t>(positions_.offset(position))];
  }

 private:
  Box positions_;
  std::vector<DecodedBrick> bricks_;
};

// The part of `box` that is in one layer.
Box layer_of(Box box, std::int64_t z) {
  box.low.z = box.high.z = z;
  return box;
}

// The bricks that the part needs: in a file with voxels, also those that own samples on its low faces.
Box needed_for(const Box& meshed, const CodingParameters& parameters) {
  Box needed = meshed;
  if (parameters.mode == FileMode::voxels)
    for (int axis = 0; axis < 3; ++axis) needed.low[axis] = std::max(needed.low[axis] - 1, std::int64_t{0});
  return needed;
}

// The most threads that may decode. Throws MemoryLimit if not even one may.
int threads_for(const CodingParameters& parameters, const MeshPart& part, const Resources& resources) {
  if (!resources.memory) return resources.threads;
  for (int threads = resources.threads; threads >= 1; --threads)
    if (memory_of_mesh_box(parameters, part, threads) <= *resources.memory) return threads;
  throw MemoryLimit("meshing a part of the volume", *resources.memory,
                    memory_of_mesh_box(parameters, part, 1), {});
}

}  // namespace

// Two layers of decoded bricks are in memory: the one that is made into tetrahedra, and the one below.
std::uint64_t memory_of_mesh_box(const CodingParameters& parameters, const MeshPart& part, int threads) {
  const BrickGrid grid = parameters.bricks();
  const Box meshed = bricks_of(part, grid), needed = needed_for(meshed, parameters);
  const Box largest = grid.closed_box({0, 0, 0});
  const std::uint64_t sample = size_of(parameters.type);
  const auto points = static_cast<std::uint64_t>(largest.count()) * sample,
             owned = static_cast<std::uint64_t>(grid.owned_box({0, 0, 0}).count()) * sample;
  const std::uint64_t brick = sizeof(DecodedBrick) + owned + LatticeBits::working_bytes(largest.size()) +
                              (parameters.mode == FileMode::grid ? points : 0);
  const double bricks = 2 * static_cast<double>(layer_of(needed, needed.low.z).count());
  const double kept = bricks * static_cast<double>(brick) +
                      static_cast<double>(MeshBuilder::working_bytes(parameters, meshed));
  return memory_of_reading(parameters, threads, true) +
         static_cast<std::uint64_t>(std::min(kept * heap_overhead, 4e18));
}

void mesh_box(const TagBricks& file, const MeshPart& part, const Resources& resources, MeshSink& sink,
              const Progress& progress) {
  const CodingParameters& parameters = file.parameters();
  const BrickGrid grid = parameters.bricks();
  const std::size_t size = size_of(parameters.type);
  const bool voxels = parameters.mode == FileMode::voxels;
  const Box meshed = bricks_of(part, grid), needed = needed_for(meshed, parameters);

  oneapi::tbb::task_arena arena(threads_for(parameters, part, resources));
  MeshBuilder mesh(file.header(), part, sink);
  const Box volume = parameters.domain().volume();
  const std::uint64_t total = static_cast<std::uint64_t>(needed.size().z);
  std::uint64_t done = 0;
  Layer below, layer;
  for (std::int64_t z = needed.low.z; z <= needed.high.z; ++z) {
    below = std::move(layer);
    layer = Layer(file, layer_of(needed, z), meshed, arena);
    const auto sample_at = [&](Index3 p) {
      const Index3 q = volume.nearest(p);
      const Index3 owner = {grid.owner(q.x), grid.owner(q.y), grid.owner(q.z)};
      const Layer& holder = owner.z < z ? below : layer;
      return holder.at(owner).samples.data() +
             static_cast<std::size_t>(grid.owned_box(owner).offset(q)) * size;
    };
    if (z >= meshed.low.z)
      for (std::int64_t y = meshed.low.y; y <= meshed.high.y; ++y)
        for (std::int64_t x = meshed.low.x; x <= meshed.high.x; ++x) {
          const DecodedBrick& brick = layer.at({x, y, z});
          if (voxels)
            mesh.add_brick({x, y, z}, brick.active, sample_at);
          else
            mesh.add_brick({x, y, z}, brick.active, [&](Index3 p) {
              return brick.points.data() + static_cast<std::size_t>(brick.active.box().offset(p)) * size;
            });
        }
    if (progress) progress(++done, total);
  }
}

}  // namespace tagrid
