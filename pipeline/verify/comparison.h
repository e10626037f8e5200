// An interface for comparing decoded rows with something.
#pragma once

#include <cstddef>
#include <vector>

#include "pipeline/decode/decoded_rows.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/statistics.h"

namespace tagrid {

/// Takes rows as they arrive. With this interface, verification without an original does not need the formats
/// of volumes.
class Comparison {
 public:
  virtual ~Comparison() = default;
  /// Takes the activity of the next brick of the rows that will be compared next.
  virtual void add_activity(const LatticeBits& active) = 0;
  /// Takes a brick of those rows, if the mesh has a bound. `values` are those of the points of its closed
  /// box.
  virtual void add_mesh(Index3 position, const LatticeBits& active, std::vector<std::byte> values) = 0;
  /// Adds the errors to `errors`, including that of the mesh if it has a bound. Throws BrokenInput at the
  /// first voxel whose error is larger than allowed.
  virtual void compare(const DecodedRows& rows, Statistics& errors) = 0;
  /// Called when everything has been compared, here or elsewhere. Throws BrokenInput if the original
  /// continues.
  virtual void finish() = 0;
};

}  // namespace tagrid
