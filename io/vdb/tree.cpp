#include "io/vdb/tree.h"

#include <algorithm>
#include <cstring>
#include <set>
#include <tuple>

#include "io/vdb/format.h"

namespace tagrid {
namespace {

using vdb::Mask;

/// Two NaNs are equal, and zeros of different sign are not.
template <class T>
bool same_bits(T a, T b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

template <std::size_t count>
void read_mask(VdbBytes& bytes, Mask<count>& mask) {
  std::memcpy(mask.bits.data(), bytes.take(count / 8), count / 8);
}

template <class T>
class TreeReader {
 public:
  TreeReader(VdbBytes& bytes, const VdbPacking& packing)
      : bytes_(bytes), packing_(packing), values_(vdb::upper_values) {}

  VdbTree<T> read() {
    bytes_.skip(4);  // the number of buffers: one
    tree_.background = bytes_.number<T>();
    const auto tiles = bytes_.number<std::uint32_t>(), children = bytes_.number<std::uint32_t>();
    for (std::uint32_t i = 0; i < tiles; ++i) {
      const Index3 low = read_root_entry();
      const T value = bytes_.number<T>();
      add_tile(low, vdb::upper_edge, value, bytes_.number<std::uint8_t>() != 0);
    }
    for (std::uint32_t i = 0; i < children; ++i) read_upper(read_root_entry());
    for (VdbLeaf& leaf : tree_.leaves) read_leaf(leaf);
    const auto by_z = [](const auto& a, const auto& b) { return a.z < b.z; };
    std::stable_sort(tree_.tiles.begin(), tree_.tiles.end(), by_z);
    std::stable_sort(tree_.leaves.begin(), tree_.leaves.end(), by_z);
    tree_.tiles.shrink_to_fit();
    tree_.leaves.shrink_to_fit();
    return std::move(tree_);
  }

 private:
  Index3 read_root_entry() {
    Index3 low;
    for (int axis = 0; axis < 3; ++axis) low[axis] = bytes_.number<std::int32_t>();
    for (int axis = 0; axis < 3; ++axis)
      if (low[axis] % vdb::upper_edge != 0) bytes_.fail("a node is at an impossible position");
    if (!roots_.emplace(low.x, low.y, low.z).second) bytes_.fail("two nodes have the same position");
    return low;
  }

  void read_upper(const Index3& low) {
    Mask<vdb::upper_values> children;
    read_node(low, children, vdb::lower_log);
    for_each_entry(children, low, vdb::lower_log,
                   [&](std::size_t, const Index3& child) { read_lower(child); });
  }

  void read_lower(const Index3& low) {
    Mask<vdb::lower_values> children;
    read_node(low, children, vdb::leaf_log);
    for_each_entry(children, low, vdb::leaf_log, [&](std::size_t, const Index3& child) {
      Mask<vdb::leaf_values> active;
      read_mask(bytes_, active);
      add_active(active, child);
      tree_.leaves.push_back({static_cast<std::int32_t>(child.x), static_cast<std::int32_t>(child.y),
                              static_cast<std::int32_t>(child.z), 0, 0});
    });
  }

  /// Reads a node, except for its children, whose edge is 2^child_log.
  template <std::size_t count>
  void read_node(const Index3& low, Mask<count>& children, int child_log) {
    Mask<count> active;
    read_mask(bytes_, children);
    read_mask(bytes_, active);
    read_vdb_values(bytes_, packing_, active, tree_.background, values_.data());
    Mask<count> tiles;
    for (std::size_t i = 0; i < count / 8; ++i) tiles.bits[i] = static_cast<std::uint8_t>(~children.bits[i]);
    for_each_entry(tiles, low, child_log, [&](std::size_t i, const Index3& tile) {
      add_tile(tile, std::int64_t{1} << child_log, values_[i], active.test(i));
    });
  }

  template <std::size_t count, class Use>
  static void for_each_entry(const Mask<count>& mask, const Index3& low, int child_log, Use use) {
    const int log =
        count == vdb::upper_values ? vdb::upper_log - vdb::lower_log : vdb::lower_log - vdb::leaf_log;
    const std::int64_t n = std::int64_t{1} << log;
    for (std::int64_t i = 0; i < static_cast<std::int64_t>(count); ++i) {
      if (!mask.test(static_cast<std::size_t>(i))) continue;
      use(static_cast<std::size_t>(i),
          low + (std::int64_t{1} << child_log) * Index3{i / (n * n), i / n % n, i % n});
    }
  }

  void add_tile(const Index3& low, std::int64_t edge, T value, bool active) {
    if (active) add_active(Box{low, low + Index3{edge - 1, edge - 1, edge - 1}});
    if (same_bits(value, tree_.background)) return;
    if (!tree_.tiles.empty()) {
      VdbTiles<T>& last = tree_.tiles.back();
      if (last.edge == edge && last.x == low.x && last.y == low.y && last.end() == low.z &&
          low.z % vdb::upper_edge != 0 && same_bits(last.value, value)) {
        ++last.count;
        return;
      }
    }
    tree_.tiles.push_back({static_cast<std::int32_t>(low.x), static_cast<std::int32_t>(low.y),
                           static_cast<std::int32_t>(low.z), static_cast<std::uint16_t>(edge), 1, value});
  }

  void add_active(const Box& box) {
    if (!tree_.active) tree_.active = box;
    Box& all = *tree_.active;
    for (int axis = 0; axis < 3; ++axis) {
      all.low[axis] = std::min(all.low[axis], box.low[axis]);
      all.high[axis] = std::max(all.high[axis], box.high[axis]);
    }
  }

  void add_active(const Mask<vdb::leaf_values>& mask, const Index3& low) {
    constexpr std::int64_t last = vdb::leaf_edge - 1;
    if (tree_.active && tree_.active->contains(Box{low, low + Index3{last, last, last}})) return;
    for_each_voxel(mask, [&](std::int64_t x, std::int64_t y, std::int64_t z) {
      const Index3 voxel = low + Index3{x, y, z};
      add_active(Box{voxel, voxel});
    });
  }

  template <class Use>
  static void for_each_voxel(const Mask<vdb::leaf_values>& mask, Use use) {
    for (std::int64_t i = 0; i < static_cast<std::int64_t>(vdb::leaf_values); ++i)
      if (mask.test(static_cast<std::size_t>(i))) use(i / 64, i / 8 % 8, i % 8);
  }

  void read_leaf(VdbLeaf& leaf) {
    leaf.position = bytes_.position();
    Mask<vdb::leaf_values> active;
    read_mask(bytes_, active);
    skip_vdb_values<T>(bytes_, packing_, active);
    leaf.size = static_cast<std::uint32_t>(bytes_.position() - leaf.position);
  }

  VdbBytes& bytes_;
  const VdbPacking& packing_;
  std::vector<T> values_;  ///< of a node
  std::set<std::tuple<std::int64_t, std::int64_t, std::int64_t>> roots_;
  VdbTree<T> tree_;
};

}  // namespace

template <class T>
VdbTree<T> read_vdb_tree(VdbBytes& bytes, const VdbPacking& packing) {
  return TreeReader<T>(bytes, packing).read();
}

template VdbTree<float> read_vdb_tree(VdbBytes&, const VdbPacking&);
template VdbTree<double> read_vdb_tree(VdbBytes&, const VdbPacking&);
template VdbTree<std::int32_t> read_vdb_tree(VdbBytes&, const VdbPacking&);

}  // namespace tagrid
