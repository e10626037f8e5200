// The description of the grids in an OpenVDB file, which precedes their voxels.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "io/vdb/bytes.h"
#include "io/vdb/transform.h"
#include "io/vdb/values.h"
#include "stages/grid/box.h"

namespace tagrid {

struct VdbGrid {
  /// As shown to people: with a number, "density[1]", if several grids have the same name.
  std::string name;
  std::string type;    ///< Without the suffix for halves.
  std::string parent;  ///< The name of the grid whose tree it shares; "" if it has its own.
  bool half = false;
  std::uint64_t position = 0;  ///< Position of the bytes after its name.
};

/// The grids of the file, in order. Throws BrokenInput if it is not an OpenVDB file of a supported version.
std::vector<VdbGrid> read_vdb_grids(VdbBytes& bytes);

/// The grid with that name; for "", the only grid. Throws UsageError that lists the grids if there is no such
/// choice, and BrokenInput if the file has no grid.
const VdbGrid& choose_vdb_grid(const std::vector<VdbGrid>& grids, const std::string& name,
                               const std::string& file);

/// Names and types of the grids, for messages.
std::string list_of(const std::vector<VdbGrid>& grids);

/// The description of one grid, before its tree.
struct VdbGridHead {
  VdbPacking packing;
  /// Metadata that tagrid wrote: texts, and the number of samples.
  std::map<std::string, std::string, std::less<>> texts;
  std::optional<Index3> dims;
  std::optional<VdbTransform> transform;  ///< Nothing if it is not linear.
};

/// Reads the head of a grid. After that, `bytes` is at the beginning of the tree, if the grid has its own.
VdbGridHead read_vdb_grid_head(VdbBytes& bytes, const VdbGrid& grid);

}  // namespace tagrid
