// Passes the grid of the coarsest mesh within a bound of the decoded voxels to whatever makes something of it.
#pragma once

#include <cstdint>
#include <string>

#include "io/tag/file.h"
#include "pipeline/memory/resources.h"
#include "pipeline/meshes/grid_bricks.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

/// Throws MemoryLimit if the grid cannot be made within `resources`, beside a taker of so many bytes.
void check_coarsened_mesh(const CodingParameters& parameters, std::uint64_t taker_bytes,
                          const Resources& resources);

/// All bricks of the grid, from a file that has not been read yet, front to back. `error` is one of samples. `path`: see coarsen_file(). Throws as take_all() does. REQUIRES: error >= 0; the volume
/// fills some space, or is padded.
void take_coarsened(TagReader& reader, bool padded, double error, const std::string& path,
                    std::uint64_t taker_bytes, const Resources& resources, GridTaker& taker,
                    const Progress& progress = {});

}  // namespace tagrid
