// Slices become the tree of a grid.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "io/formats/vdb/openvdb_library.h"
#include "stages/grid/box.h"

namespace tagrid {

/// G is the type of the grid. Voxels that differ from the background are active; a leaf of equal ones becomes
/// a tile.
template <class G>
class GridBuilder {
 public:
  using Value = typename G::ValueType;

  /// Voxels of `box`. Voxels within `tolerance` of the background become the background.
  GridBuilder(const Box& box, Value background, double tolerance)
      : grid_(G::create(background)),
        box_(box),
        background_(background),
        tolerance_(tolerance),
        next_z_(box.low.z) {
    layer_.reserve(static_cast<std::size_t>(edge * slice_voxels()));
  }

  /// Takes the voxels of the next slice, x fastest.
  void add(const std::vector<Value>& slice) {
    layer_.insert(layer_.end(), slice.begin(), slice.end());
    ++next_z_;
    if (next_z_ % edge == 0 || next_z_ > box_.high.z) {
      add_layer();
      layer_.clear();
    }
  }

  /// The grid, when it has all slices.
  typename G::Ptr finish() {
    openvdb::tools::pruneTiles(grid_->tree(), openvdb::zeroVal<Value>(), false);
    return grid_;
  }

  /// The most bytes that the tree of a volume takes: no voxel is background.
  static std::uint64_t memory(const Box& box) {
    constexpr double block = 16;  // of the heap, beside what is in it
    using Tree = typename G::TreeType;
    using Lower = typename Tree::RootNodeType::ChildNodeType::ChildNodeType;
    using Upper = typename Tree::RootNodeType::ChildNodeType;
    const auto nodes = [&](std::int64_t dim) {
      double count = 1;
      for (int axis = 0; axis < 3; ++axis)
        count *= static_cast<double>(floor_div(box.high[axis], dim) - floor_div(box.low[axis], dim) + 1);
      return count;
    };
    // The file describes each leaf in 9 bytes, which are in memory twice while it is written.
    const double leaf = sizeof(Leaf) + block + Leaf::SIZE * sizeof(Value) + block + 18;
    const double bytes = nodes(Leaf::DIM) * leaf + nodes(Lower::DIM) * (sizeof(Lower) + block) +
                         nodes(Upper::DIM) * (sizeof(Upper) + 10 * block) +
                         static_cast<double>(edge * box.size().x * box.size().y) * sizeof(Value);
    return static_cast<std::uint64_t>(std::min(bytes, 4e18));
  }

 private:
  using Leaf = typename G::TreeType::LeafNodeType;
  static constexpr std::int64_t edge = Leaf::DIM;

  static std::int64_t floor_div(std::int64_t a, std::int64_t b) {
    return a >= 0 ? a / b : -((b - 1 - a) / b);
  }
  static bool same_bits(Value a, Value b) { return std::memcmp(&a, &b, sizeof(Value)) == 0; }
  std::int64_t slice_voxels() const { return box_.size().x * box_.size().y; }

  Value or_background(Value value) const {
    const bool is_near = tolerance_ > 0 && std::abs(static_cast<double>(value) -
                                                    static_cast<double>(background_)) <= tolerance_;
    return is_near ? background_ : value;
  }

  void add_layer() {
    const std::int64_t low_z = (next_z_ - 1) & -edge;
    const Box layer = {{box_.low.x, box_.low.y, std::max(low_z, box_.low.z)},
                       {box_.high.x, box_.high.y, next_z_ - 1}};
    auto tree = grid_->getAccessor();
    for (std::int64_t y = box_.low.y & -edge; y <= box_.high.y; y += edge)
      for (std::int64_t x = box_.low.x & -edge; x <= box_.high.x; x += edge)
        add_leaf(tree, layer, {x, y, low_z});
  }

  void add_leaf(auto& tree, const Box& layer, const Index3& low) {
    const Box part = intersection({low, low + Index3{edge - 1, edge - 1, edge - 1}}, layer);
    values_.assign(Leaf::SIZE, background_);
    for (std::int64_t z = part.low.z; z <= part.high.z; ++z)
      for (std::int64_t y = part.low.y; y <= part.high.y; ++y) {
        const Value* row = layer_.data() + layer.offset({part.low.x, y, z});
        Value* to = values_.data() + ((part.low.x - low.x) << 6 | (y - low.y) << 3 | (z - low.z));
        for (std::int64_t x = part.low.x; x <= part.high.x; ++x, ++row, to += edge * edge)
          *to = or_background(*row);
      }
    const auto is_background = [&](Value value) { return same_bits(value, background_); };
    if (std::ranges::all_of(values_, is_background)) return;
    const openvdb::Coord origin(static_cast<int>(low.x), static_cast<int>(low.y), static_cast<int>(low.z));
    // The library takes -0 for 0 when it joins tiles.
    const bool may_be_tile = !(values_[0] == 0 && !same_bits(values_[0], Value(0)));
    if (may_be_tile &&
        std::ranges::all_of(values_, [&](Value value) { return same_bits(value, values_[0]); })) {
      tree.addTile(1, origin, values_[0], true);
      return;
    }
    auto* leaf = new Leaf(origin, background_);
    for (openvdb::Index i = 0; i < Leaf::SIZE; ++i)
      if (!is_background(values_[i])) leaf->setValueOn(i, values_[i]);
    tree.addLeaf(leaf);
  }

  typename G::Ptr grid_;
  Box box_;
  Value background_;
  double tolerance_;
  std::int64_t next_z_;
  std::vector<Value> layer_;   ///< the slices of a layer of leaves
  std::vector<Value> values_;  ///< of a leaf
};

}  // namespace tagrid
