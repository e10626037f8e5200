// Volumes written as grids.
#pragma once

#include <memory>

#include "io/programs/serve_writer.h"

namespace tagrid {

/// Begins a grid. Options, all of them texts:
///   grid        its name; by default that of the grid from which the volume came, or "density"
///   background  the value of inactive voxels; by default the background of that grid, or the value of the first sample,
///               which lies outside the body in most scans
///   tolerance   samples at most this far from the background become the background; 0 by default
///   type        float or int32: what samples of 8 and 16 bits are stored as; float by default
///   max-error   the largest error that the samples already have; absent if there is no bound
/// int32 and floats are stored unchanged, uint32 as double. The entire tree is in memory until the file is
/// written.
std::unique_ptr<ServedOutput> begin_vdb(const WriteRequest& request);

}  // namespace tagrid
