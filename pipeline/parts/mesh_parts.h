// Meshes with materials by several ranks: each makes the bricks of some layers, and rank 0 puts them together.
#pragma once

#include <string>

#include "pipeline/materials/brick_spool.h"
#include "pipeline/materials/material_mesh.h"
#include "pipeline/ranks/ranks.h"

namespace tagrid {

struct MeshOrder {
  std::string input;  ///< a regular file, which all ranks see
  std::int64_t volume = 0;
  MaterialMeshOptions options;
  Resources resources{0};  ///< per rank
};

/// Collective. Makes all bricks; on rank 0, `bricks` then has them.
void mesh_parts(Ranks& ranks, const MeshOrder& order, BrickSpool& bricks);

/// As write_material_mesh() for one process; the file is the same. Called by rank 0; the others call serve().
Finished<MaterialMeshResult> write_material_mesh(Ranks& ranks, const MaterialMeshRun& run);

}  // namespace tagrid
