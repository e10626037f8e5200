// Volumes from OpenVDB files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "io/files/file_bytes.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// Whether a file that begins so is one of OpenVDB: at least 8 bytes.
bool begins_vdb(std::string_view bytes);

/// A grid of floats, doubles or 32-bit integers as a volume: the box of its active voxels, or, if tagrid
/// wrote it, the whole volume. An inactive voxel has the value that the tree has there. All functions throw
/// BrokenInput and WorldError.
///
/// Opening reads the file once and keeps an index, 24 bytes for a leaf of 8^3 voxels; then the leaves that
/// share 8 slices are in memory, and nothing else.
class VdbReader {
 public:
  /// `file` is a regular one. `grid` is the name of one of its grids; "": it has only one.
  VdbReader(std::unique_ptr<FileBytes> file, const std::string& grid);
  VdbReader(VdbReader&&) noexcept;
  VdbReader& operator=(VdbReader&&) noexcept;
  ~VdbReader();

  /// The type is that of the grid, or the one that the grid says it had before it was written by tagrid.
  const VolumeInfo& info() const;
  /// Writes slice `z` to `out`: samples of info().type, x fastest. Throws BrokenInput for a value that is
  /// none of that type. REQUIRES: 0 <= z < dims.z.
  void read_slice(std::int64_t z, std::byte* out);
  std::uint64_t file_size() const;
  /// Bytes that this takes at most, from now on.
  std::uint64_t memory() const;

 private:
  struct Open;
  std::unique_ptr<Open> open_;
};

}  // namespace tagrid
