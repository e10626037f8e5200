// What decoded rows are compared with.
#pragma once

#include <cstddef>
#include <vector>

#include "pipeline/decode/decoded_rows.h"
#include "stages/grid/lattice_bits.h"
#include "stages/volume/statistics.h"

namespace tagrid {

/// Takes rows as they come. Verifying without an original knows of no format of volumes.
class Comparison {
 public:
  virtual ~Comparison() = default;
  /// The activity of the next brick of the rows that are compared next.
  virtual void add_activity(const LatticeBits& active) = 0;
  /// A brick of those rows, whose mesh has a bound. `values` are those of the points of its closed box.
  virtual void add_mesh(Index3 position, const LatticeBits& active, std::vector<std::byte> values) = 0;
  /// Adds the errors to `errors`, that of the mesh too where there is one. Throws BrokenInput at the first
  /// voxel that is further off than it may be.
  virtual void compare(const DecodedRows& rows, Statistics& errors) = 0;
  /// Everything was compared, here or by others. Throws BrokenInput if the original goes on.
  virtual void finish() = 0;
};

}  // namespace tagrid
