// Reads slices of an OpenVDB grid.
#pragma once

#include <cstdint>
#include <vector>

#include "io/vdb/tree.h"

namespace tagrid {

/// Voxels of a grid, slice by slice, in any order; neighbouring slices are read together.
template <class T>
class VdbSlices {
 public:
  /// Slices of `box`. `bytes` must outlive this.
  VdbSlices(VdbBytes& bytes, const VdbPacking& packing, VdbTree<T> tree, const Box& box);

  /// The slice of voxels with this z, x fastest; valid until the next call. REQUIRES: z is in the box.
  const std::vector<T>& slice(std::int64_t z);
  /// The largest number of bytes that this takes.
  std::uint64_t memory() const;

 private:
  void read_layer(std::int64_t z);
  void fill_tiles();
  void fill_leaves(std::int64_t z);

  VdbBytes& bytes_;
  VdbPacking packing_;
  VdbTree<T> tree_;
  Box box_;
  std::vector<T> slice_;
  /// The layer of leaves that was read last: its first z, its leaves, their voxels, and the tiles that extend
  /// into it.
  std::int64_t layer_ = INT64_MIN;
  std::vector<VdbLeaf> leaves_;
  std::vector<T> voxels_;
  std::vector<VdbTiles<T>> tiles_;
};

}  // namespace tagrid
