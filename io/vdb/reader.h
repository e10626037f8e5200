// Reads volumes from OpenVDB files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "io/files/file_bytes.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// True if `bytes`, the first 8 or more of a file, are those of an OpenVDB file.
bool begins_vdb(std::string_view bytes);

/// A grid of floats, doubles or 32-bit integers as a volume. The volume is the box of the active voxels or,
/// if tagrid wrote the file, the original volume. An inactive voxel has the value that the tree has there.
/// All functions throw BrokenInput and WorldError.
///
/// Opening reads the file once and keeps an index of 24 bytes for each leaf of 8^3 voxels. After that, only
/// the leaves that share 8 slices are in memory.
class VdbReader {
 public:
  /// REQUIRES: `file` is a regular file. `grid` is the name of one of its grids; "" if it has only one.
  VdbReader(std::unique_ptr<FileBytes> file, const std::string& grid);
  VdbReader(VdbReader&&) noexcept;
  VdbReader& operator=(VdbReader&&) noexcept;
  ~VdbReader();

  /// The type is that of the grid, or the original type that tagrid recorded when it wrote the grid.
  const VolumeInfo& info() const;
  /// Writes slice `z` to `out`: samples of info().type, x fastest. Throws BrokenInput if a value does not fit
  /// that type. REQUIRES: 0 <= z < dims.z.
  void read_slice(std::int64_t z, std::byte* out);
  std::uint64_t file_size() const;
  /// The largest number of bytes that this takes from now on.
  std::uint64_t memory() const;

 private:
  struct Open;
  std::unique_ptr<Open> open_;
};

}  // namespace tagrid
