// The mesh of a .tag file, handed to whoever takes it.
#pragma once

#include "io/mesh/mesh_sink.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/memory/progress.h"
#include "pipeline/memory/resources.h"
#include "pipeline/mesh/mesh_builder.h"

namespace tagrid {

/// Whether the mesh fills no space, as the volume is one slice or less.
bool is_flat(const CodingParameters& parameters, const MeshPart& part);

/// The whole mesh, from a file that was not read yet, front to back. Memory: that of decoding, and the
/// activity of one layer of bricks. Throws BrokenInput, WorldError, and what sink and progress throw.
/// REQUIRES: no box; the grid has the level; !is_flat().
void mesh_all(TagReader& reader, const MeshPart& part, const Resources& resources, MeshSink& sink,
              const Progress& progress = {});

/// The part of the mesh that meets a box. Reads the bricks that have some of it, and those below them, whose
/// samples lie on their low faces. Memory: these bricks of two layers. Progress is in layers of bricks. Throws
/// as mesh_all() does, and MemoryLimit. REQUIRES: a box within the volume; the grid has the level; !is_flat().
void mesh_box(const TagBricks& file, const MeshPart& part, const Resources& resources, MeshSink& sink,
              const Progress& progress = {});

}  // namespace tagrid
