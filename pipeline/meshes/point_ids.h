// Numbers the points of a mesh that is made brick by brick; bricks that share a point give it the same
// number.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/meshes/id_planes.h"
#include "stages/grid/domain.h"

namespace tagrid {

/// The ids of lattice points, for one brick at a time. A point on a face, edge or corner between bricks keeps
/// the id that it got in the first of them: each brick takes over the ids that are known on its low faces, and leaves
/// all ids on its high faces. As the brick on the other side of the x face knows most (see IdPlanes), its ids are taken
/// over last.
class PointIds {
 public:
  static constexpr std::int64_t none = IdPlanes::none;

  /// Only for the bricks at `positions`.
  PointIds(const BrickGrid& bricks, const Box& positions) : planes_(bricks, positions, 1) {}
  explicit PointIds(const BrickGrid& bricks)
      : PointIds(bricks, Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)})) {}

  /// The heap that it takes from the first brick on: the ids of one brick, and of one plane for each axis.
  static std::uint64_t working_bytes(const BrickGrid& bricks, const Box& positions);

  /// Takes over the ids that are known on the low faces. REQUIRES: bricks come in the order of their numbers,
  /// and each ends before the next begins.
  void begin_brick(Index3 position);
  /// The id of a point of the brick; if it is `none`, the caller sets it. REQUIRES: the brick's closed box
  /// contains `p`.
  std::int64_t& of(Index3 p) { return ids_[static_cast<std::size_t>(planes_.box().offset(p))]; }
  /// Leaves the ids on the high faces for later bricks.
  void end_brick();

 private:
  IdPlanes planes_;
  std::vector<std::int64_t> ids_;  ///< of all points of the brick, x fastest
};

}  // namespace tagrid
