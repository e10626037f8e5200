// Builds the isosurface from bricks, with the numbers and places of its vertices.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/meshes/sinks.h"
#include "io/tag/header.h"
#include "io/volume/volume_info.h"
#include "pipeline/meshes/grid_bricks.h"
#include "pipeline/meshes/id_planes.h"
#include "stages/surface/surface.h"

namespace tagrid {

/// The part of the surface that is built.
struct SurfacePart {
  /// The prefix of the grid up to this level: points of higher levels are left out.
  int level = 0;
  /// Only the surface in tetrahedra that meet this box; both ends are included.
  std::optional<Box> box = std::nullopt;
  /// Closes the surface at the border of the volume and around NaN.
  bool close = false;
  /// Measures the area, which takes some time.
  bool area = false;
};

struct SurfaceCounts {
  std::int64_t vertices = 0, triangles = 0;
  double area = 0;  ///< in the world, if it is measured
  /// Edges of one triangle alone that lie in the border of the volume.
  std::int64_t border_edges = 0;
  /// True if values are NaN where the surface may have passed.
  bool has_gaps = false;
};

/// Builds the surface of bricks, in the order of bricks. Vertices are numbered in the order of the bricks
/// and, in a brick, in the raster order of the midpoints of their edges.
class SurfaceBuilder : public GridTaker {
 public:
  /// `header` and `sink` must outlive the builder. `positions`: of the bricks that will come.
  SurfaceBuilder(const TagHeader& header, const Box& positions, const SurfacePart& part,
                 const SurfaceLevel& level, SurfaceSink& sink);

  /// The most heap that a builder takes for the bricks at `positions`, whatever the values.
  static std::uint64_t working_bytes(const CodingParameters& parameters, const Box& positions);

  void add_brick(Index3 position, const LatticeBits& active, const ValueOf& value_of) override;

  const SurfaceCounts& counts() const { return counts_; }

 private:
  BrickSurface surface_of(const LatticeBits& active, const ValueOf& value_of) const;
  void number(Index3 position, const Box& box, std::span<const SurfaceVertex> vertices);
  std::array<double, 3> world_position(const SurfaceVertex& vertex, const Box& box) const;
  void add_area(const SurfacePiece& piece);

  const CodingParameters& parameters_;
  Geometry geometry_;
  bool mirrored_;
  SurfacePart part_;
  SurfaceGrid grid_;
  SurfaceLevel level_;
  EdgeIds edges_;
  SurfaceSink& sink_;
  std::vector<std::int64_t> ids_;  // of the vertices of a brick
  SurfaceCounts counts_;
};

/// The level in samples of a value, if the file has a slope and an intercept. Throws UsageError if slices
/// have their own slopes or no sample has the value, BrokenInput if the slope is 0. `name`: of the file.
SurfaceLevel surface_level(double value, const TagHeader& header, const std::string& name);

}  // namespace tagrid
