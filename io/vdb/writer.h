// Volumes to OpenVDB files.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "io/volume/volume_sink.h"

namespace tagrid {

/// How a volume becomes a grid.
struct VdbOptions {
  /// Its name; "": that of the grid which the volume once was, or else "density".
  std::string grid;
  /// The value of inactive voxels. Without it: what the grid had which the volume once was, or else the value
  /// of the first sample, which lies outside of the body in most scans.
  std::optional<double> background;
  /// Samples so near to the background become the background.
  double tolerance = 0;
  /// The largest error that the samples have already; nothing where there is no bound.
  std::optional<double> max_error = 0.0;
};

/// What a grid has become.
struct VdbSummary {
  std::string grid;
  double background = 0, tolerance = 0;
  std::optional<double> max_error;  ///< of every voxel, the tolerance included
  std::uint64_t active_voxels = 0, leaves = 0;
};

/// Begins a volume as a grid of the file at `path`: integers of up to 16 bits and int32 as int32, uint32 as
/// double, floats as they are. Voxels that are the background are inactive. Samples are written in order, and
/// the file with the last of them. Leaves wait in a temporary file beside until all are there; memory is 8
/// slices and 24 bytes for each 8^3 voxels that are not all background. Equal volumes give equal bytes. Throws
/// UsageError for a background that is no number of the samples' type.
std::unique_ptr<VolumeSink> create_vdb(const std::string& path, const VolumeInfo& info,
                                       const SinkOptions& options, const VdbOptions& grid);

/// Bytes that writing a grid takes at most.
std::uint64_t memory_of_vdb_writer(const VolumeInfo& info);

/// What a volume has become; nothing where it is written in another format. REQUIRES: all samples were
/// written.
std::optional<VdbSummary> vdb_summary(const VolumeSink& sink);

}  // namespace tagrid
