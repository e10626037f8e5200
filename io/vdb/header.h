// What an OpenVDB file says of its grids, before their voxels.
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
  std::string
      name;  ///< As people give it: with a number behind, "density[1]", where several have the same name.
  std::string type;    ///< Without the ending for halves.
  std::string parent;  ///< The name of the grid whose tree it shares; "" if it has its own.
  bool half = false;
  std::uint64_t position = 0;  ///< Where what follows its name begins.
};

/// The grids of the file, in order. Throws BrokenInput if it is none of a supported version.
std::vector<VdbGrid> read_vdb_grids(VdbBytes& bytes);

/// The grid of that name; for "", the only one. Throws UsageError with the grids that there are, and
/// BrokenInput if there is none.
const VdbGrid& choose_vdb_grid(const std::vector<VdbGrid>& grids, const std::string& name,
                               const std::string& file);

/// Their names and types, for messages.
std::string list_of(const std::vector<VdbGrid>& grids);

/// What a grid says before its tree.
struct VdbGridHead {
  VdbPacking packing;
  /// Metadata that tagrid wrote: texts, and the number of samples.
  std::map<std::string, std::string, std::less<>> texts;
  std::optional<Index3> dims;
  std::optional<VdbTransform> transform;  ///< Nothing where it is not linear.
};

/// Reads it; then `bytes` are where the tree begins, if the grid has its own.
VdbGridHead read_vdb_grid_head(VdbBytes& bytes, const VdbGrid& grid);

}  // namespace tagrid
