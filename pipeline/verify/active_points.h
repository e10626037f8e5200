// Counts the points of a grid that is not stored.
#pragma once

#include <string>

#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

/// The numbers of active points of each level, by the grid of the decoded samples. Decodes the file, which has not been
/// read yet, in the memory that meshing takes. Throws BrokenInput, WorldError, MemoryLimit, and the exceptions of
/// `progress`. REQUIRES: the file stores no grid.
Statistics count_active_points(TagReader& reader, const Resources& resources, const Progress& progress = {});

/// The summary of a file, as summary_of() reads it. The levels of a grid that is not stored are counted.
TagSummary summary_with_levels(const std::string& path, const Resources& resources,
                               const Progress& progress = {});

}  // namespace tagrid
