// The numbers that bricks of a mesh or a surface leave on their faces for later bricks.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "stages/grid/brick_grid.h"

namespace tagrid {

/// The ids of points on the faces between bricks, for one brick at a time. Points are those of the lattice,
/// or with a `scale` of 2 those with half the distances.
///
/// Later bricks share a staircase of high faces with those so far: the x face of the last brick, the y faces
/// of the last row, and the z faces of the last layer. So one plane for each axis is enough, provided that
/// each brick leaves on its high faces all ids that it knows, also those that earlier bricks left where its
/// high faces meet its low ones. The last earlier brick that contains a point then knows its id if any does:
/// the one on the other side of the x face if the point lies there; otherwise of the y face; otherwise of the
/// z face.
class IdPlanes {
 public:
  static constexpr std::int64_t none = -1;

  /// Only for the bricks at `positions`.
  IdPlanes(const BrickGrid& bricks, const Box& positions, int scale);

  /// The heap that it takes from the first brick on.
  static std::uint64_t working_bytes(const BrickGrid& bricks, const Box& positions, int scale);

  /// REQUIRES: bricks come in the order of their numbers.
  void begin_brick(Index3 position);
  /// The points of the brick.
  const Box& box() const { return box_; }
  /// True if there was a brick on the other side of the low face across `axis`.
  bool has_low_face(int axis) const { return position_[axis] != positions_.low[axis]; }
  /// True if there will be one on the other side of the high face.
  bool has_high_face(int axis) const { return position_[axis] != positions_.high[axis]; }
  Box low_face(int axis) const;
  Box high_face(int axis) const;
  /// The id of a point of a face; on the low one until the high one overwrites it. REQUIRES: has that face.
  std::int64_t& at(int axis, Index3 p) { return planes_[axis][place(axis, p)]; }
  std::int64_t at(int axis, Index3 p) const { return planes_[axis][place(axis, p)]; }
  /// Sets all ids on the high faces to `none`.
  void clear_high_faces();

 private:
  Box scaled(const Box& box) const;
  Index3 points_of_planes() const;
  std::size_t place(int axis, Index3 p) const;

  BrickGrid bricks_;
  Box positions_;  ///< of the bricks that will come
  int scale_;
  Box all_;                              ///< the points of all of them
  Index3 position_;                      ///< of the current brick
  Box box_;                              ///< its points
  std::vector<std::int64_t> planes_[3];  ///< by axis
};

/// The ids of lattice points, for one brick at a time. A point on a face, edge or corner between bricks keeps
/// the id that it got in the first of them: each brick takes over the ids that are known on its low faces,
/// and leaves all ids on its high faces. As the brick on the other side of the x face knows most (see
/// IdPlanes), its ids are taken over last.
class PointIds {
 public:
  static constexpr std::int64_t none = IdPlanes::none;

  /// Only for the bricks at `positions`.
  PointIds(const BrickGrid& bricks, const Box& positions) : planes_(bricks, positions, 1) {}
  explicit PointIds(const BrickGrid& bricks)
      : PointIds(bricks, Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)})) {}

  /// The heap that it takes from the first brick on: the ids of one brick, and of one plane for each axis.
  static std::uint64_t working_bytes(const BrickGrid& bricks, const Box& positions);

  /// Takes over the ids on the low faces. REQUIRES: bricks come in order; each ends before the next begins.
  void begin_brick(Index3 position);
  /// The id of a point of the brick; if `none`, the caller sets it. REQUIRES: the closed box contains `p`.
  std::int64_t& of(Index3 p) { return ids_[static_cast<std::size_t>(planes_.box().offset(p))]; }
  /// Leaves the ids on the high faces for later bricks.
  void end_brick();

 private:
  IdPlanes planes_;
  std::vector<std::int64_t> ids_;  ///< of all points of the brick, x fastest
};

/// The ids of vertices on the faces between bricks, of which each brick has few. The sum of its ends names an
/// edge of the grid (see EdgeNumbers). Each brick leaves on its high faces the ids of its vertices, and those
/// that earlier bricks left where its high faces meet its low ones.
class EdgeIds {
 public:
  static constexpr std::int64_t none = IdPlanes::none;

  /// For the bricks at `positions`.
  EdgeIds(const BrickGrid& bricks, const Box& positions) : planes_(bricks, positions, 2) {}

  /// The heap that it takes from the first brick on: a plane for each axis, and lines.
  static std::uint64_t working_bytes(const BrickGrid& bricks, const Box& positions);

  /// REQUIRES: bricks come in the order of their numbers, and each ends before the next begins.
  void begin_brick(Index3 position);
  /// The id that an earlier brick gave to the vertex on an edge of this brick, or none.
  std::int64_t carried(Index3 sum_of_ends) const;
  /// True if a later brick may ask for the edge.
  bool is_shared(Index3 sum_of_ends) const;
  /// Leaves an id for later bricks. REQUIRES: is_shared(); no more carried() for this brick.
  void leave(Index3 sum_of_ends, std::int64_t id);
  /// Makes room on the high faces for leave(). To be called after the last carried() of the brick.
  void clear_high_faces();

 private:
  IdPlanes planes_;
  std::vector<std::pair<Index3, std::int64_t>> inherited_;  // on lines between a low and a high face
};

}  // namespace tagrid
