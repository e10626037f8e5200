// Passes the coarsest mesh within a bound of the decoded voxels to a sink.
#pragma once

#include <string>

#include "io/mesh/mesh_sink.h"
#include "io/tag/file.h"
#include "pipeline/memory/progress.h"
#include "pipeline/memory/resources.h"
#include "pipeline/mesh/mesh_builder.h"

namespace tagrid {

/// Throws MemoryLimit if the mesh cannot be made within `resources`.
void check_coarsened_mesh(const CodingParameters& parameters, const MeshPart& part,
                          const Resources& resources);

/// The mesh, from a file that has not been read yet, front to back. `error` is in units of values: the meaning of samples
/// in the header counts. `path`: see coarsen_file(). Throws as mesh_all() does. REQUIRES: error >= 0; part.level is the
/// deepest; !is_flat().
void mesh_coarsened(TagReader& reader, const MeshPart& part, double error, const std::string& path,
                    const Resources& resources, MeshSink& sink, const Progress& progress = {});

}  // namespace tagrid
