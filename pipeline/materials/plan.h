// The memory of a mesh with materials.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/materials/mesh_assembler.h"
#include "pipeline/materials/settings.h"
#include "pipeline/memory/resources.h"
#include "stages/grid/box.h"

namespace tagrid {

/// The bricks of a layer that may have tetrahedra, and the samples that they need.
struct MeshLayer {
  std::vector<Box> bricks;
  Box samples{{0, 0, 0}, {-1, -1, -1}};
};

/// The samples that a brick of the mesh needs.
Box samples_for(const MaterialMeshJob& job, const Box& closed_box);

/// All layers, from the lowest z on; some may have no bricks.
std::vector<MeshLayer> layers_of(const MaterialMeshJob& job);

/// The samples that all layers need.
Box samples_of(const std::vector<MeshLayer>& layers);

/// Bricks that are made but not yet put together.
constexpr int bricks_in_flight(int threads) { return threads + 1; }
/// What count_touching_edges() may take.
inline constexpr std::uint64_t bytes_for_edges = std::uint64_t{64} << 20;

struct MeshMemory {
  int threads = 1;
  PartsMemory parts;
};

/// The threads that fit into the limit on memory, and what is left for parts and surfaces. `besides`: memory of what
/// writes the mesh. Noise of values, the worst input, needs all of the plan; most volumes need a third. Labels that
/// change every few samples can need more. Throws MemoryLimit.
MeshMemory memory_for_mesh(const CodingParameters& parameters, const MaterialMeshJob& job,
                           const std::vector<MeshLayer>& layers, const Resources& resources,
                           std::uint64_t besides);

}  // namespace tagrid
