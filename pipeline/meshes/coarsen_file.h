// Coarsens the grid of a .tag file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "io/tag/file.h"
#include "pipeline/memory/plan.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "stages/coarsen/coarsen.h"
#include "stages/grid/lattice_bits.h"

namespace tagrid {

struct CoarseningPlan {
  DecodePlan decoding;
  int threads = 1;  ///< that refine bricks
};

/// The plan of coarsen_file() with a taker that has up to `taker_bytes` on the heap. Throws MemoryLimit.
CoarseningPlan plan_coarsening(const CodingParameters& parameters, std::uint64_t taker_bytes,
                               const Resources& resources);

/// Takes a brick of the grid. `value_of` returns a pointer to the decoded sample at a lattice point of the brick's closed
/// box, as its type lies in memory; outside the volume, to the nearest one.
using TakeCoarsened = std::function<void(Index3 position, const LatticeBits& active,
                                         const std::function<const std::byte*(Index3)>& value_of)>;

/// Decodes a file that has not been read yet, front to back, finds the coarsest grid within `bound` of its decoded voxels,
/// and passes the bricks at `positions` in the order of their numbers. The grid of the file itself plays no part. Memory:
/// that of decoding, a second copy of the slices of a layer of bricks, and a few bricks for each thread. Nameless temporary
/// files in the folder of `path` take about as many bytes as the samples, and a bit for each of them. Throws BrokenInput,
/// WorldError, MemoryLimit, and the exceptions of `take` and `progress`.
void coarsen_file(TagReader& reader, const MeshBound& bound, const Box& positions, const std::string& path,
                  std::uint64_t taker_bytes, const Resources& resources, const TakeCoarsened& take,
                  const Progress& progress = {});

}  // namespace tagrid
