// Volumes from OpenVDB files.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// Whether a file that begins so is one of OpenVDB: at least 8 bytes.
bool begins_vdb(std::string_view bytes);

/// A grid of floats, doubles or 32-bit integers as a volume: the box of its active voxels, or, if tagrid
/// wrote it, the whole volume. An inactive voxel has the value that the tree has there. The type is that of
/// the grid, or the one that the grid says it had before it was written by tagrid; a value that is none of
/// that type is BrokenInput.
///
/// Opening reads the file once and keeps an index, 24 bytes for a leaf of 8^3 voxels; then the leaves that
/// share 8 slices are in memory, and nothing else.
///
/// `file` was opened at `path`. `source.vdb_grid` is the name of one of its grids; "": it has only one. Throws
/// UsageError for a pipe, and for a description of samples.
std::unique_ptr<VolumeSource> open_vdb(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source);

}  // namespace tagrid
