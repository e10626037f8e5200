// The grids of an OpenVDB file, and a strict look at one of them: the library itself does not notice if a
// file ends early.
#pragma once

#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/bytes/memory_size.h"
#include "io/formats/vdb/openvdb_library.h"
#include "stages/grid/box.h"

namespace tagrid {

/// What has to know the type of a grid.
struct GridKind {
  double (*background)(const openvdb::GridBase& grid);
  /// Passes over the values of all leaves, which must be in the stream.
  void (*pass_over_leaves)(openvdb::GridBase& grid, std::istream& stream);
};

/// Of grids of type G.
template <class G>
constexpr GridKind kind_of_grid = {[](const openvdb::GridBase& grid) {
                                     return static_cast<double>(static_cast<const G&>(grid).background());
                                   },
                                   [](openvdb::GridBase& grid, std::istream& stream) {
                                     // Leaf by leaf, in the order of the file: the grid's own function to
                                     // read no voxels also fills all nodes with their background, which takes
                                     // minutes where damage made nodes of leaves.
                                     for (auto leaf = static_cast<G&>(grid).tree().beginLeaf(); leaf; ++leaf)
                                       leaf->readBuffers(stream, openvdb::CoordBBox(),
                                                         grid.saveFloatAsHalf());
                                   }};

/// What is known of a grid without the values of its leaves.
struct GridLook {
  openvdb::GridBase::Ptr grid;  ///< metadata and transform; its tree is empty
  double background = 0;        ///< value of the tree where nothing is
  std::optional<Box> active;    ///< the box of its active voxels
  std::uint64_t memory = 0;     ///< bytes that it takes while its leaves stay in the file
};

/// Reads with errors: whatever is not in the file is BrokenInput.
class GridFile {
 public:
  explicit GridFile(const std::string& path);
  ~GridFile();

  const std::vector<openvdb::io::GridDescriptor>& grids() const { return grids_; }
  /// Walks through a grid, which takes its memory for that time.
  GridLook look_at(const openvdb::io::GridDescriptor& grid, const GridKind& kind);

 private:
  class Archive;

  /// The grid that has the tree of `grid`, as several can share one.
  const openvdb::io::GridDescriptor& tree_of(const openvdb::io::GridDescriptor& grid) const;

  std::string path_;
  std::unique_ptr<Archive> archive_;
  std::vector<openvdb::io::GridDescriptor> grids_;
};

/// BrokenInput about an OpenVDB file.
[[noreturn]] void throw_broken_vdb(const std::string& path, const std::string& why);

// Slices of a grid, while its leaves stay in the file.

/// G is the type of the grid. In memory are the tree without the values of its leaves, and 8 slices: those
/// that a layer of leaves has.
template <class G>
class GridSlices {
 public:
  using Value = typename G::ValueType;
  /// Of a bit: a byte that is 0 or 1.
  using Sample = std::conditional_t<std::is_same_v<Value, bool>, std::uint8_t, Value>;

  /// The voxels of `box` in the grid with this unique name.
  GridSlices(const std::string& path, const std::string& name, const Box& box) : file_(path), box_(box) {
    file_.setCopyMaxBytes(0);  // no copy in the directory for temporary files
    file_.open();
    grid_ = openvdb::gridPtrCast<G>(file_.readGrid(name));
  }

  /// The samples of slice z, x fastest, until the next call.
  const Sample* slice(std::int64_t z) {
    const std::int64_t layer = z & -edge;
    if (layer != layer_) read_layer(layer);
    return samples_.data() + static_cast<std::size_t>((z - layer) * box_.size().x * box_.size().y);
  }

  static std::uint64_t memory(const Box& box) {
    return static_cast<std::uint64_t>(edge * box.size().x * box.size().y) * sizeof(Sample);
  }

 private:
  using Leaf = typename G::TreeType::LeafNodeType;
  static constexpr std::int64_t edge = Leaf::DIM;

  void read_layer(std::int64_t z) {
    const Index3 size = box_.size();
    layer_ = INT64_MIN;
    samples_.resize(memory_size(static_cast<std::uint64_t>(edge * size.x * size.y)));
    // Not by an accessor: that reads the values of leaves into the tree.
    const auto& tree = grid_->tree();
    for (std::int64_t y = box_.low.y & -edge; y <= box_.high.y; y += edge)
      for (std::int64_t x = box_.low.x & -edge; x <= box_.high.x; x += edge) {
        const openvdb::Coord low(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z));
        const Box part =
            intersection({{x, y, z}, {x + edge - 1, y + edge - 1, z + edge - 1}},
                         {{box_.low.x, box_.low.y, z}, {box_.high.x, box_.high.y, z + edge - 1}});
        if (const Leaf* leaf = tree.probeConstLeaf(low)) {
          const auto copy = loaded(*leaf);
          fill(part, [&](std::int64_t i, std::int64_t j, std::int64_t k) {
            return copy->getValue(static_cast<openvdb::Index>((i - x) << 6 | (j - y) << 3 | (k - z)));
          });
        } else {
          const Value value = tree.getValue(low);  // no tile is smaller than a leaf
          fill(part, [&](std::int64_t, std::int64_t, std::int64_t) { return value; });
        }
      }
    layer_ = z;
  }

  /// A copy, which reads the values from the file, and is gone with them.
  static std::unique_ptr<const Leaf> loaded(const Leaf& leaf) {
    auto copy = std::make_unique<const Leaf>(leaf);
    try {
      copy->getValue(0);
    } catch (...) {
      // After a failure, the library takes the place of the values for one in the file, and frees it twice.
      static_cast<void>(copy.release());
      throw;
    }
    return copy;
  }

  template <class ValueAt>
  void fill(const Box& part, ValueAt value_at) {
    const Index3 size = box_.size();
    for (std::int64_t z = part.low.z; z <= part.high.z; ++z)
      for (std::int64_t y = part.low.y; y <= part.high.y; ++y) {
        Sample* row = samples_.data() + ((z - part.low.z) * size.y + y - box_.low.y) * size.x - box_.low.x;
        for (std::int64_t x = part.low.x; x <= part.high.x; ++x)
          row[x] = static_cast<Sample>(value_at(x, y, z));
      }
  }

  openvdb::io::File file_;
  Box box_;
  typename G::Ptr grid_;
  std::int64_t layer_ = INT64_MIN;
  std::vector<Sample> samples_;
};

}  // namespace tagrid
