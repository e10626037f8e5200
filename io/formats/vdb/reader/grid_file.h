// The grids of an OpenVDB file, and a strict look at one of them: the library itself does not notice if a
// file ends early.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

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

}  // namespace tagrid
