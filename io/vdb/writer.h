// Writes volumes to OpenVDB files.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "io/volume/volume_sink.h"

namespace tagrid {

/// How a volume becomes a grid.
struct VdbOptions {
  /// The name of the grid; "": the name of the grid from which the volume came, or otherwise "density".
  std::string grid;
  /// The value of inactive voxels. If not given: the background of the grid from which the volume came, or
  /// otherwise the value of the first sample, which lies outside the body in most scans.
  std::optional<double> background;
  /// Samples at most this far from the background become the background.
  double tolerance = 0;
  /// The largest error that the samples already have; nothing if there is no bound.
  std::optional<double> max_error = 0.0;
};

/// Statistics of the written grid.
struct VdbSummary {
  std::string grid;
  double background = 0, tolerance = 0;
  std::optional<double> max_error;  ///< of every voxel, including the tolerance
  std::uint64_t active_voxels = 0, leaves = 0;
};

/// Begins a volume as a grid in the file at `path`. Integers of up to 16 bits and int32 are stored as int32,
/// uint32 as double, floats as they are. Voxels with the background value are inactive. Samples are written
/// in order; the call with the last samples writes the file. Until then, leaves are stored in a temporary
/// file beside it. Memory: 8 slices, and 24 bytes for each 8^3 voxels that are not all background. Equal
/// volumes give equal bytes. Throws UsageError if the background is not a value of the samples' type.
std::unique_ptr<VolumeSink> create_vdb(const std::string& path, const VolumeInfo& info,
                                       const SinkOptions& options, const VdbOptions& grid);

/// The largest number of bytes that writing a grid takes.
std::uint64_t memory_of_vdb_writer(const VolumeInfo& info);

/// Statistics of the written grid; nothing for other formats. REQUIRES: all samples were written.
std::optional<VdbSummary> vdb_summary(const VolumeSink& sink);

}  // namespace tagrid
