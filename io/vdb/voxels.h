// Voxels on their way to an OpenVDB file: packed leaves in a temporary file, and the list that puts them in
// order.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "io/files/spool_file.h"
#include "stages/grid/box.h"

namespace tagrid {

/// A leaf of 8^3 voxels, or a tile, which is 8^3 active voxels of one value.
struct VdbSlot {
  std::int32_t x = 0, y = 0, z = 0;  ///< The lowest voxel.
  std::uint32_t size = 0;            ///< Size of a leaf in the temporary file; 0: a tile.
  std::uint64_t where = 0;           ///< For a leaf, its position there; for a tile, the bits of its value.
};

/// Takes slices and keeps the voxels that differ from the background. T is float, double or std::int32_t.
/// Memory: 24 bytes for each 8^3 voxels that are not all background.
template <class T>
class VdbVoxels {
 public:
  /// Voxels of `box`. Voxels within `tolerance` of the background become the background. `spool` is new and
  /// outlives this.
  VdbVoxels(const Box& box, T background, double tolerance, SpoolFile& spool);

  /// Takes slices `z` to `z + count - 1`, x fastest. REQUIRES: they are the next ones, and in one layer of
  /// leaves.
  void add(std::int64_t z, std::int64_t count, const T* voxels);

  T background() const { return background_; }
  std::vector<VdbSlot>& slots() { return slots_; }
  /// The box of the active voxels, and their number.
  const std::optional<Box>& active() const { return active_; }
  std::uint64_t active_count() const { return active_count_; }
  /// The checksum of all leaves, in the order of arrival.
  std::uint64_t checksum() const { return checksum_; }

 private:
  void gather(const Box& leaf, const Box& voxels_of, const T* voxels);
  void add_leaf(const Index3& low);
  void add_active(const Index3& voxel);
  bool is_background(T value) const;

  Box box_;
  T background_;
  double tolerance_;
  SpoolFile& spool_;
  std::vector<VdbSlot> slots_;
  std::optional<Box> active_;
  std::uint64_t active_count_ = 0, checksum_ = 0;
  std::vector<T> leaf_;  ///< of the current leaf, in the stored order
  std::vector<std::byte> record_;
};

/// The voxel value of a tile.
template <class T>
T vdb_tile_value(const VdbSlot& tile);

}  // namespace tagrid
