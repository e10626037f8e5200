// Passes the isosurface of a .tag file to a sink.
#pragma once

#include <string>

#include "io/meshes/surface_sink.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/memory/resources.h"
#include "pipeline/meshes/surface_builder.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

/// The level in samples of a value: slope * sample + intercept, where the file has a slope. Throws UsageError
/// if each slice has a slope of its own or no sample has the value, BrokenInput if the slope is 0. `name`: of
/// the file.
SurfaceLevel surface_level(double value, const TagHeader& header, const std::string& name);

/// The entire surface, from a file that has not been read yet, front to back. Memory: that of decoding, and
/// of the surface in one brick. Throws BrokenInput, WorldError, MemoryLimit, and the exceptions of `sink` and
/// `progress`. REQUIRES: no box; the grid has the level; the volume is more than one slice along each axis.
SurfaceCounts surface_of_all(TagReader& reader, const SurfacePart& part, const SurfaceLevel& level,
                             const Resources& resources, SurfaceSink& sink, const Progress& progress = {});

/// The surface in the tetrahedra that meet a box; without a box, in all. Reads the bricks that contain some
/// of them, and the bricks below these, which own the samples on their low faces. Progress counts layers of
/// bricks. Otherwise like surface_of_all(). REQUIRES: the box is within the volume.
SurfaceCounts surface_of_box(const TagBricks& file, const SurfacePart& part, const SurfaceLevel& level,
                             const Resources& resources, SurfaceSink& sink, const Progress& progress = {});

}  // namespace tagrid
