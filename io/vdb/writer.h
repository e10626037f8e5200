// Volumes to OpenVDB files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "io/files/output_file.h"
#include "io/volume/volume_info.h"

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

/// Bytes that a VdbWriter takes at most.
std::uint64_t memory_of_vdb_writer(const VolumeInfo& info);

/// A volume as a grid: integers of up to 16 bits and int32 as int32, uint32 as double, floats as they are.
/// Voxels that are the background are inactive. Leaves wait in a temporary file until all are there; memory
/// is 8 slices and 24 bytes for each 8^3 voxels that are not all background. Equal volumes give equal bytes.
class VdbWriter {
 public:
  /// `path` is where the file is going to be: its temporary file lies beside. Throws UsageError for a
  /// background that is no number of the samples' type.
  VdbWriter(const std::string& path, const VolumeInfo& info, const VdbOptions& options);
  VdbWriter(VdbWriter&&) noexcept;
  VdbWriter& operator=(VdbWriter&&) noexcept;
  ~VdbWriter();

  /// Takes the next samples, in pieces of any whole number of them.
  void write(std::span<const std::byte> samples);
  /// Writes the file. REQUIRES: all samples were written.
  void finish(OutputFile& file);
  /// REQUIRES: finish().
  const VdbSummary& summary() const;

 private:
  struct Grid;
  template <class T>
  struct GridOf;
  std::unique_ptr<Grid> grid_;
};

}  // namespace tagrid
