#include "pipeline/materials/plan.h"

#include <algorithm>

#include "pipeline/decode/graph.h"
#include "pipeline/materials/sample_window.h"
#include "stages/grid/brick_grid.h"

namespace tagrid {
namespace {

constexpr std::int64_t points_of_brick = 64;  // along an edge, if root cubes are not larger
constexpr std::uint64_t least_bytes_for_parts = std::uint64_t{16} << 20;  // of all but a few meshes

Box covering(const Box& a, const Box& b) {
  if (a.empty()) return b;
  Box box = a;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = std::min(a.low[axis], b.low[axis]);
    box.high[axis] = std::max(a.high[axis], b.high[axis]);
  }
  return box;
}

// What bricks share: nodes and faces near the faces of bricks, in tables. The bytes per cube of edge H at a face were
// measured with noise.
std::uint64_t bytes_of_shared(const MeshLayer& layer) {
  constexpr std::uint64_t bytes_of_cube = 600;
  std::uint64_t bytes = 0;
  for (const Box& brick : layer.bricks) {
    const Index3 size = brick.high - brick.low;
    bytes +=
        static_cast<std::uint64_t>(size.x * size.y + size.y * size.z + size.z * size.x) / 4 * bytes_of_cube;
  }
  return bytes;
}

}  // namespace

Box samples_for(const MaterialMeshJob& job, const Box& closed_box) {
  const MaterialLattice& lattice = job.settings.lattice;
  return job.places.around(intersection(lattice.region(closed_box), lattice.box()), job.reach());
}

std::vector<MeshLayer> layers_of(const MaterialMeshJob& job) {
  const MaterialLattice& lattice = job.settings.lattice;
  const auto cubes = static_cast<int>(std::max<std::int64_t>(1, points_of_brick / lattice.cube_size));
  const BrickGrid bricks{lattice.domain(), cubes};
  std::vector<MeshLayer> layers(static_cast<std::size_t>(bricks.bricks(2)));
  for (std::int64_t b = 0; b < bricks.count(); ++b) {
    const Index3 position = bricks.position(b);
    const Box closed = bricks.closed_box(position);
    if (!may_meet_region(job.settings, closed)) continue;
    MeshLayer& layer = layers[static_cast<std::size_t>(position.z)];
    layer.bricks.push_back(closed);
    layer.samples = covering(layer.samples, samples_for(job, closed));
  }
  return layers;
}

Box samples_of(const std::vector<MeshLayer>& layers) {
  Box all{{0, 0, 0}, {-1, -1, -1}};
  for (const MeshLayer& layer : layers)
    if (!layer.bricks.empty()) all = covering(all, layer.samples);
  return all;
}

MeshMemory memory_for_mesh(const CodingParameters& parameters, const MaterialMeshJob& job,
                           const std::vector<MeshLayer>& layers, const Resources& resources,
                           std::uint64_t besides) {
  std::uint64_t window = 0, of_brick = 0, of_result = 0, shared = 0;
  const std::uint64_t sample = job.label_smoothing ? sizeof(Material) : sizeof(float);
  for (const MeshLayer& layer : layers) {
    if (layer.bricks.empty()) continue;
    window = std::max(window, SampleWindow::working_bytes(parameters, job.numbers, samples_of(layers),
                                                          layer.samples.size().z));
    shared = std::max(shared, bytes_of_shared(layer));
    for (const Box& brick : layer.bricks) {
      const auto samples = static_cast<std::uint64_t>(samples_for(job, brick).count()) * sample;
      of_brick = std::max(of_brick, samples + working_bytes_of_brick_mesh(job.settings, brick));
      of_result = std::max(of_result, bytes_of_brick_mesh(job.settings, brick));
    }
  }
  const auto of_all_times = [&](int threads) {
    return memory_of_reading(parameters, threads) + besides + least_bytes_for_parts;
  };
  const auto of_meshing = [&](int threads) {
    // Decoding takes turns with meshing, but freed memory may stay with the process.
    return std::max(window + static_cast<std::uint64_t>(threads) * of_brick + of_result + shared,
                    bytes_for_edges);
  };
  MeshMemory memory;
  memory.threads = threads_within(resources, "a mesh with materials",
                                  [&](int threads) { return of_all_times(threads) + of_meshing(threads); });
  if (resources.memory) {
    memory.parts.limit = *resources.memory;
    const std::uint64_t always = of_all_times(memory.threads) + resources.besides - least_bytes_for_parts;
    memory.parts.others = always + of_meshing(memory.threads);
    memory.parts.others_at_end = always + bytes_for_edges;
  }
  return memory;
}

}  // namespace tagrid
