// Do bricks agree on the faces that they share?
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "grid/coding_parameters.h"
#include "pipeline/decode_graph.h"

namespace tagrid {

/// Compares the activity, and in a file without voxels the values of the active points, on the low faces of
/// every brick with those of the bricks below. Holds one layer of bricks.
class SharedFaces {
 public:
  explicit SharedFaces(const CodingParameters& parameters)
      : bricks_(parameters.bricks()), size_(size_of(parameters.type)) {}

  /// The first point on which `brick` disagrees with one before it. Bricks come in the order of their
  /// numbers.
  std::optional<Index3> first_difference(const DecodedBrick& brick);

 private:
  struct Face {
    LatticeBits active;
    std::vector<std::byte> points;  ///< of the box of `active`; empty in a file with voxels
  };
  Face cut(const DecodedBrick& brick, const Box& face) const;
  static std::optional<Index3> compare(const Face& a, const Face& b, std::size_t sample_size);

  BrickGrid bricks_;
  std::size_t size_;
  std::map<std::pair<std::int64_t, int>, Face> high_faces_;  ///< by brick and axis
};

}  // namespace tagrid
