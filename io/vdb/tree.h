// An index of the tree of an OpenVDB grid: where its voxels are in the file. One pass over the file makes it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "io/vdb/bytes.h"
#include "io/vdb/values.h"
#include "stages/grid/box.h"

namespace tagrid {

/// Cubes of one value, one after the other along z.
template <class T>
struct VdbTiles {
  std::int32_t x = 0, y = 0, z = 0;  ///< The lowest voxel.
  std::uint16_t edge = 0, count = 0;
  T value = {};

  std::int64_t end() const { return std::int64_t{z} + std::int64_t{edge} * count; }
};

/// A leaf of 8^3 voxels, and where its values are in the file.
struct VdbLeaf {
  std::int32_t x = 0, y = 0, z = 0;
  std::uint32_t size = 0;
  std::uint64_t position = 0;
};

/// Takes 24 bytes a leaf, and as many for up to 32 tiles.
template <class T>
struct VdbTree {
  T background = {};
  std::vector<VdbTiles<T>> tiles;  ///< By z. Tiles that are the background are left out, active or not.
  std::vector<VdbLeaf> leaves;     ///< By z.
  std::optional<Box> active;       ///< The box of the active voxels; nothing if there are none.
};

/// Reads the tree that begins where `bytes` are. T is float, double or std::int32_t. Throws BrokenInput.
template <class T>
VdbTree<T> read_vdb_tree(VdbBytes& bytes, const VdbPacking& packing);

}  // namespace tagrid
