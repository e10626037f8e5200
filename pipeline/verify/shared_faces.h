// Checks that bricks agree on the faces that they share.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "pipeline/decode/graph.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// A face of which only one brick was seen: `below`, or the brick after it along `axis`.
struct OpenFace {
  std::int64_t below = 0;
  int axis = 0;
  std::uint64_t checksum = 0;  ///< XXH3 of the content that must be equal on both sides
};

/// Compares the low faces of every brick with those of the bricks below: the activity and, in a file without
/// voxels, the values of the active points. Holds one layer of bricks.
class SharedFaces {
 public:
  explicit SharedFaces(const CodingParameters& parameters)
      : bricks_(parameters.bricks()), size_(size_of(parameters.type)) {}

  /// The first point on which `brick` disagrees with an earlier one. Bricks, all or some, come in order.
  std::optional<Index3> first_difference(const DecodedBrick& brick);
  /// The faces that have not been compared yet.
  std::vector<OpenFace> open_faces() const;

 private:
  struct Face {
    LatticeBits active;
    std::vector<std::byte> points;  ///< of the box of `active`; empty in a file with voxels
  };
  Face cut(const DecodedBrick& brick, const Box& face) const;
  static std::uint64_t checksum(const Face& face);
  static std::optional<Index3> compare(const Face& a, const Face& b, std::size_t sample_size);

  BrickGrid bricks_;
  std::size_t size_;
  std::map<std::pair<std::int64_t, int>, Face> high_faces_;  ///< by brick and axis
  std::vector<OpenFace> open_low_faces_;
};

/// Two bricks that disagree on the face that they share.
struct Disagreement {
  std::int64_t below = 0, above = 0;
};

/// Compares the open faces of all parts of a volume.
class OpenFacePairs {
 public:
  explicit OpenFacePairs(const BrickGrid& bricks) : bricks_(bricks) {}

  /// Parts come in any order.
  void add(const std::vector<OpenFace>& faces);
  /// The first of all added bricks that disagrees with an earlier one. REQUIRES: all parts were added.
  std::optional<Disagreement> first_difference() const;

 private:
  BrickGrid bricks_;
  std::map<std::pair<std::int64_t, int>, std::uint64_t> waiting_;  ///< checksums, by brick and axis
  std::optional<Disagreement> first_;
};

}  // namespace tagrid
