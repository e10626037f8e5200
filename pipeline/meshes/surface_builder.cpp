#include "pipeline/meshes/surface_builder.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <utility>

#include "io/errors/errors.h"
#include "io/metadata/lengths.h"
#include "io/text/text.h"
#include "io/volume/volume_info.h"
#include "pipeline/decode/values.h"
#include "stages/grid/lattice.h"
#include "stages/grid/lattice_bits.h"
#include "stages/values/points/field.h"

namespace tagrid {
namespace {

// The grid that is marched: the prefix, and root corners, which are vertices whatever a damaged file says.
LatticeBits grid_of(const LatticeBits& active, int cube_size, int level) {
  LatticeBits grid = level < max_level(cube_size) ? prefix_of(active, cube_size, level) : active;
  set_root_corners(grid, cube_size);
  return grid;
}

// The values of the active points, at their places among all points of the brick.
template <class T>
std::vector<T> points_of(const LatticeBits& grid, const ValueOf& value_of) {
  std::vector<T> points(static_cast<std::size_t>(grid.box().count()));
  for_each_set(grid, [&](Index3 p, std::size_t i) { std::memcpy(&points[i], value_of(p), sizeof(T)); });
  return points;
}

Index3 point_of(const Box& box, std::uint32_t number) {
  const auto x = static_cast<std::uint32_t>(box.size().x), y = static_cast<std::uint32_t>(box.size().y);
  const std::uint32_t row = number / x;
  return box.low + Index3{number % x, row % y, row / y};
}

}  // namespace

SurfaceBuilder::SurfaceBuilder(const TagHeader& header, const Box& positions, const SurfacePart& part,
                               const SurfaceLevel& level, SurfaceSink& sink)
    : parameters_(header.parameters),
      geometry_(in_one_unit(header.metadata.geometry())),
      mirrored_(is_mirrored(geometry_)),
      part_(part),
      grid_{parameters_.cube_size, parameters_.domain().volume(), part.box, part.close},
      level_(level),
      edges_(parameters_.bricks(), positions),
      sink_(sink) {}

std::uint64_t SurfaceBuilder::working_bytes(const CodingParameters& parameters, const Box& positions) {
  const BrickGrid bricks = parameters.bricks();
  const Index3 brick = bricks.closed_box(positions.low).size();
  const auto points = static_cast<std::uint64_t>(brick.x * brick.y * brick.z);
  // While the surface is made there are its values; then there are the ids.
  return EdgeIds::working_bytes(bricks, positions) + LatticeBits::working_bytes(brick) +
         working_bytes_of_surface(parameters.type, brick, parameters.cube_size) +
         points * size_of(parameters.type) + most_surface_vertices(brick) * sizeof(std::int64_t);
}

void SurfaceBuilder::add_brick(Index3 position, const LatticeBits& active, const ValueOf& value_of) {
  BrickSurface surface = surface_of(active, value_of);
  if (mirrored_)
    for (auto& triangle : surface.triangles) std::swap(triangle[1], triangle[2]);
  const Box& box = active.box();
  number(position, box, surface.vertices);
  const auto position_of = [&](std::size_t i) { return world_position(surface.vertices[i], box); };
  const SurfacePiece piece{ids_, position_of, surface.triangles};
  if (part_.area) add_area(piece);
  counts_.triangles += static_cast<std::int64_t>(surface.triangles.size());
  counts_.border_edges += surface.border_edges;
  counts_.has_gaps = counts_.has_gaps || surface.has_gaps;
  if (!surface.triangles.empty()) sink_.add(piece);
}

BrickSurface SurfaceBuilder::surface_of(const LatticeBits& active, const ValueOf& value_of) const {
  const LatticeBits grid = grid_of(active, parameters_.cube_size, part_.level);
  return with_sample_type(parameters_.type, [&](auto type) {
    using T = decltype(type);
    std::vector<T> points = points_of<T>(grid, value_of);
    return surface_of_brick<T>(points, grid, grid_, level_);
  });
}

void SurfaceBuilder::number(Index3 position, const Box& box, std::span<const SurfaceVertex> vertices) {
  const auto sum_of_ends = [&](const SurfaceVertex& v) {
    return point_of(box, v.low) + point_of(box, v.high);
  };
  edges_.begin_brick(position);
  ids_.clear();
  ids_.reserve(vertices.size());
  for (const SurfaceVertex& v : vertices) {
    const std::int64_t known = edges_.carried(sum_of_ends(v));
    ids_.push_back(known != EdgeIds::none ? known : counts_.vertices++);
  }
  edges_.clear_high_faces();
  for (std::size_t i = 0; i < vertices.size(); ++i)
    if (const Index3 sum = sum_of_ends(vertices[i]); edges_.is_shared(sum)) edges_.leave(sum, ids_[i]);
}

std::array<double, 3> SurfaceBuilder::world_position(const SurfaceVertex& vertex, const Box& box) const {
  const Index3 first = parameters_.domain().first();
  const Index3 low = point_of(box, vertex.low) - first, high = point_of(box, vertex.high) - first;
  std::array<double, 3> p;
  for (int axis = 0; axis < 3; ++axis)
    p[static_cast<std::size_t>(axis)] =
        static_cast<double>(low[axis]) + vertex.at * static_cast<double>(high[axis] - low[axis]);
  return to_world(geometry_, p);
}

void SurfaceBuilder::add_area(const SurfacePiece& piece) {
  for (const auto& triangle : piece.triangles) {
    const auto a = piece.position(triangle[0]), b = piece.position(triangle[1]),
               c = piece.position(triangle[2]);
    const double p[] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, q[] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    const double n[] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
    counts_.area += std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
  }
}

SurfaceLevel surface_level(double iso, const TagHeader& header, const std::string& name) {
  if (header.metadata.has_slopes_of_slices())
    throw UsageError(
        "{}: each slice has its own slope (slice_slopes), so a value is a different sample in each; with {}, "
        "the level is a stored sample; for a level in values, decode the volume with {}, and encode the "
        "result",
        name, Setting{"samples", "stored samples"}, Setting{"values", "values"});
  require_scale(header.metadata, {"iso", "the level of a surface"});
  for (const auto& [key, value] : header.metadata.pairs())
    if (key == "rescale_slope" && number_of(value).value_or(0) == 0)
      throw BrokenInput(fmt::format("{}: the header: rescale_slope is {}, which is not a slope", name,
                                    quoted(std::string_view(value))));
  const Rescale rescale = header.metadata.rescale();
  const SurfaceLevel level{(iso - rescale.intercept) / rescale.slope, rescale.slope < 0};
  if (!std::isfinite(level.value))
    throw UsageError(fmt::format("{}: the value {} has no finite sample with the slope {} of this file", name,
                                 iso, rescale.slope));
  return level;
}

}  // namespace tagrid
