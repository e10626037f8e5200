// Passes the mesh of a .tag file to a sink.
#pragma once

#include "io/meshes/mesh_sink.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/memory/plan.h"
#include "pipeline/memory/resources.h"
#include "pipeline/meshes/mesh_builder.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

/// The plan of mesh_all(). Throws MemoryLimit.
DecodePlan plan_mesh(const CodingParameters& parameters, const Resources& resources);

/// The entire mesh, from a file that has not been read yet, front to back. Memory: that of decoding, and the
/// activity of one layer of bricks. Throws BrokenInput, WorldError, and the exceptions of `sink` and
/// `progress`. REQUIRES: no box; the grid has the level; padded, or !is_flat().
void mesh_all(TagReader& reader, const MeshPart& part, const Resources& resources, MeshSink& sink,
              const Progress& progress = {});

/// The memory of mesh_box() with a number of threads.
std::uint64_t memory_of_mesh_box(const CodingParameters& parameters, const MeshPart& part, int threads);

/// The part of the mesh that meets a box. Reads the bricks that contain some of it, and the bricks below
/// them, which own the samples on their low faces. Memory: these bricks of two layers. Progress counts layers
/// of bricks. Throws as mesh_all() does, and MemoryLimit. REQUIRES: a box within the volume; the grid has the
/// level; padded, or !is_flat().
void mesh_box(const TagBricks& file, const MeshPart& part, const Resources& resources, MeshSink& sink,
              const Progress& progress = {});

}  // namespace tagrid
