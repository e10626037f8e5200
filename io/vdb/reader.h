// Reads volumes from OpenVDB files.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// True if `bytes`, the first 8 or more of a file, are those of an OpenVDB file.
bool begins_vdb(std::string_view bytes);

/// A grid of floats, doubles or 32-bit integers as a volume. The volume is the box of the active voxels or,
/// if tagrid wrote the file, the original volume. An inactive voxel has the value that the tree has there. The
/// type is that of the grid, or the original type that tagrid recorded when it wrote the grid; a value that
/// does not fit this type is BrokenInput.
///
/// Opening reads the file once and keeps an index of 24 bytes for each leaf of 8^3 voxels. After that, only
/// the leaves that share 8 slices are in memory.
///
/// `file` was opened at `path`. `source.vdb_grid` is the name of one of its grids; "" if it has only one.
/// Throws UsageError for a pipe, and for a description of samples.
std::unique_ptr<VolumeSource> open_vdb(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source);

}  // namespace tagrid
