#include "io/vdb/slices.h"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "io/vdb/format.h"

namespace tagrid {

template <class T>
VdbSlices<T>::VdbSlices(VdbBytes& bytes, const VdbPacking& packing, VdbTree<T> tree, const Box& box)
    : bytes_(bytes), packing_(packing), tree_(std::move(tree)), box_(box) {}

template <class T>
const std::vector<T>& VdbSlices<T>::slice(std::int64_t z) {
  assert(z >= box_.low.z && z <= box_.high.z);
  if (const std::int64_t layer = z & -vdb::leaf_edge; layer != layer_) read_layer(layer);
  slice_.assign(static_cast<std::size_t>(box_.size().x * box_.size().y), tree_.background);
  fill_tiles();
  fill_leaves(z);
  return slice_;
}

template <class T>
std::uint64_t VdbSlices<T>::memory() const {
  std::uint64_t most_leaves = 0, leaves = 0;
  for (std::size_t i = 0; i < tree_.leaves.size(); ++i) {
    leaves = i > 0 && tree_.leaves[i].z == tree_.leaves[i - 1].z ? leaves + 1 : 1;
    most_leaves = std::max(most_leaves, leaves);
  }
  // The lists of a layer grow: allow 3 times their content.
  return tree_.leaves.size() * sizeof(VdbLeaf) + 4 * tree_.tiles.size() * sizeof(VdbTiles<T>) +
         most_leaves * (vdb::leaf_values * sizeof(T) + 3 * sizeof(VdbLeaf)) +
         static_cast<std::uint64_t>(box_.size().x * box_.size().y) * sizeof(T);
}

/// Reads the leaves that begin at `z`.
template <class T>
void VdbSlices<T>::read_layer(std::int64_t z) {
  layer_ = INT64_MIN;
  leaves_.clear();
  tiles_.clear();
  const auto before = [](const VdbLeaf& leaf, std::int64_t low) { return leaf.z < low; };
  const auto meets_box = [&](std::int64_t x, std::int64_t y, std::int64_t edge) {
    return x <= box_.high.x && x + edge > box_.low.x && y <= box_.high.y && y + edge > box_.low.y;
  };
  auto leaf = std::lower_bound(tree_.leaves.begin(), tree_.leaves.end(), z, before);
  for (; leaf != tree_.leaves.end() && leaf->z == z; ++leaf)
    if (meets_box(leaf->x, leaf->y, vdb::leaf_edge)) leaves_.push_back(*leaf);
  for (const VdbTiles<T>& tiles : tree_.tiles) {
    if (tiles.z >= z + vdb::leaf_edge) break;
    if (tiles.end() > z && meets_box(tiles.x, tiles.y, tiles.edge)) tiles_.push_back(tiles);
  }
  const std::size_t voxels = leaves_.size() * vdb::leaf_values;
  // The voxels of this layer and of the one before are not in memory at the same time.
  if (voxels > voxels_.capacity()) voxels_ = {};
  voxels_.resize(voxels);
  T* next = voxels_.data();
  for (const VdbLeaf& l : leaves_) {
    bytes_.seek_to(l.position, l.size);
    vdb::Mask<vdb::leaf_values> active;
    std::memcpy(active.bits.data(), bytes_.take(vdb::leaf_values / 8), vdb::leaf_values / 8);
    read_vdb_values(bytes_, packing_, active, tree_.background, next);
    next += vdb::leaf_values;
  }
  layer_ = z;
}

template <class T>
void VdbSlices<T>::fill_tiles() {
  const std::int64_t width = box_.size().x;
  for (const VdbTiles<T>& tiles : tiles_) {
    const std::int64_t x_begin = std::max<std::int64_t>(tiles.x, box_.low.x) - box_.low.x;
    const std::int64_t x_end =
        std::min<std::int64_t>(tiles.x + std::int64_t{tiles.edge} - 1, box_.high.x) - box_.low.x + 1;
    const std::int64_t y_end = std::min<std::int64_t>(tiles.y + std::int64_t{tiles.edge} - 1, box_.high.y);
    for (std::int64_t y = std::max<std::int64_t>(tiles.y, box_.low.y); y <= y_end; ++y) {
      T* row = slice_.data() + (y - box_.low.y) * width;
      std::fill(row + x_begin, row + x_end, tiles.value);
    }
  }
}

template <class T>
void VdbSlices<T>::fill_leaves(std::int64_t z) {
  const std::int64_t width = box_.size().x;
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    const VdbLeaf& leaf = leaves_[i];
    const T* voxels = voxels_.data() + i * vdb::leaf_values + (z - leaf.z);
    const std::int64_t x_begin = std::max<std::int64_t>(leaf.x, box_.low.x),
                       y_begin = std::max<std::int64_t>(leaf.y, box_.low.y);
    const std::int64_t x_end = std::min(leaf.x + vdb::leaf_edge - 1, box_.high.x),
                       y_end = std::min(leaf.y + vdb::leaf_edge - 1, box_.high.y);
    for (std::int64_t y = y_begin; y <= y_end; ++y) {
      T* row = slice_.data() + (y - box_.low.y) * width;
      for (std::int64_t x = x_begin; x <= x_end; ++x)
        row[x - box_.low.x] = voxels[vdb::entry(x - leaf.x, y - leaf.y, 0, vdb::leaf_log)];
    }
  }
}

template class VdbSlices<float>;
template class VdbSlices<double>;
template class VdbSlices<std::int32_t>;

}  // namespace tagrid
