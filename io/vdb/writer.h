// Writes volumes to OpenVDB files.
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
  /// Its name; "": the name of the grid from which the volume came, or else "density".
  std::string grid;
  /// The value of inactive voxels. Without it: the background of the grid from which the volume came, or else
  /// the value of the first sample, which lies outside the body in most scans.
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

/// The largest number of bytes that a VdbWriter takes.
std::uint64_t memory_of_vdb_writer(const VolumeInfo& info);

/// Writes a volume as a grid: integers of up to 16 bits and int32 as int32, uint32 as double, floats as they
/// are. Voxels with the background value are inactive. Leaves wait in a temporary file until all are there.
/// Memory: 8 slices, and 24 bytes for each 8^3 voxels that are not all background. Equal volumes give equal
/// bytes.
class VdbWriter {
 public:
  /// `path` is where the file will be: the temporary file is created beside it. Throws UsageError if the
  /// background is not a value of the samples' type.
  VdbWriter(const std::string& path, const VolumeInfo& info, const VdbOptions& options);
  VdbWriter(VdbWriter&&) noexcept;
  VdbWriter& operator=(VdbWriter&&) noexcept;
  ~VdbWriter();

  /// Takes the next samples, in pieces of any whole number of samples.
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
