// Volumes in OpenVDB files: https://www.openvdb.org
#pragma once

#include <memory>
#include <string>

#include "io/programs/serve_reader.h"

namespace tagrid {

/// Opens a grid of floats, halves, doubles, 32-bit integers, or bits: the one that the option "grid" names, otherwise the
/// only one. The volume is the box of the active voxels or, if tagrid wrote the file, the original volume. An inactive
/// voxel has the value that the tree has there. The type is that of the grid, or the original type that tagrid recorded
/// when it wrote the grid; a value that does not fit this type is BrokenInput.
std::unique_ptr<ServedVolume> open_vdb(const std::string& path, const ReaderOptions& options);

}  // namespace tagrid
