#include "pipeline/meshes/mesh_builder.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

#include "io/metadata/lengths.h"
#include "stages/grid/lattice.h"
#include "stages/mesh/cut.h"
#include "stages/mesh/tetrahedra.h"
#include "stages/values/points/field.h"

namespace tagrid {
namespace {

// The field at all points of a brick, as samples. `value_of(p)` points to the value of a lattice point.
std::vector<std::byte> field_of(const LatticeBits& grid, const CodingParameters& parameters,
                                const ValueOf& value_of) {
  std::vector<std::byte> bytes;
  with_sample_type(parameters.type, [&](auto type) {
    using T = decltype(type);
    const Box& box = grid.box();
    std::vector<T> points;
    points.reserve(static_cast<std::size_t>(box.count()));
    for_each_point_of(box, [&](Index3 p) {
      T value;
      std::memcpy(&value, value_of(p), sizeof value);
      points.push_back(value);
    });
    const auto field = interpolate_points<T>(points, grid, parameters.cube_size);
    const std::vector<T> samples = rounded_field<T>(field, points, grid, parameters.cube_size);
    const auto all = std::as_bytes(std::span(samples));
    bytes.assign(all.begin(), all.end());
  });
  return bytes;
}

}  // namespace

MeshBuilder::MeshBuilder(const TagHeader& header, const Box& positions, const MeshPart& part, MeshSink& sink)
    : parameters_(header.parameters),
      geometry_(in_one_unit(header.metadata.geometry())),
      mirrored_(is_mirrored(geometry_)),
      part_(part),
      ids_(parameters_.bricks(), positions),
      sink_(sink) {
  const std::size_t points = most_points(parameters_, positions);
  coordinates_.reserve(3 * points);
  values_.reserve(size_of(parameters_.type) * points);
  connectivity_.reserve(4 * batch);
  levels_.reserve(batch);
}

std::size_t MeshBuilder::most_points(const CodingParameters& parameters, const Box& positions) {
  const auto of_brick = static_cast<std::size_t>(parameters.bricks().closed_box(positions.low).count());
  return std::min(4 * batch, of_brick);
}

std::uint64_t MeshBuilder::working_bytes(const CodingParameters& parameters, const Box& positions) {
  const BrickGrid bricks = parameters.bricks();
  const Box brick = bricks.closed_box(positions.low);
  const std::uint64_t sample = size_of(parameters.type);
  const std::uint64_t waiting = most_points(parameters, positions) * (3 * sizeof(double) + sample) +
                                batch * (4 * sizeof(std::int64_t) + sizeof(std::uint8_t));
  // field_of() has the values of the points, the field, and the field as samples and as their bytes.
  const std::uint64_t field =
      static_cast<std::uint64_t>(brick.count()) * (field_number_bytes(parameters.type) + 3 * sample);
  return PointIds::working_bytes(bricks, positions) + waiting + field +
         LatticeBits::working_bytes(brick.size());
}

void MeshBuilder::add_brick(Index3 position, const LatticeBits& active, const ValueOf& value_of) {
  ids_.begin_brick(position);
  if (part_.padded || parameters_.domain().volume().contains(active.box()))
    for_each_leaf_tetrahedron(active, active.box(), parameters_.cube_size, part_.level,
                              [&](const Tetrahedron& t) { add_tetrahedron(t.vertices, t.level, value_of); });
  else
    add_cut_leaves(active, value_of);
  ids_.end_brick();
  flush();
}

void MeshBuilder::add_cut_leaves(const LatticeBits& active, const ValueOf& value_of) {
  // A prefix has a different field.
  const LatticeBits grid = prefix_of(active, parameters_.cube_size, part_.level);
  const std::vector<std::byte> field = field_of(grid, parameters_, value_of);
  const std::size_t size = size_of(parameters_.type);
  const ValueOf field_at = [&](Index3 p) {
    return field.data() + static_cast<std::size_t>(grid.box().offset(p)) * size;
  };
  const Box volume = parameters_.domain().volume();
  for_each_leaf_tetrahedron(grid, grid.box(), parameters_.cube_size, part_.level, [&](const Tetrahedron& t) {
    if (!reaches_beyond(t.vertices, volume)) return add_tetrahedron(t.vertices, t.level, field_at);
    for (const auto& piece : cut_at(t.vertices, volume)) add_tetrahedron(piece, t.level, field_at);
  });
}

void MeshBuilder::add_tetrahedron(const std::array<Index3, 4>& vertices, int level, const ValueOf& value_of) {
  if (part_.box && !meets(vertices, *part_.box)) return;
  std::array<std::int64_t, 4> ids;
  for (std::size_t i = 0; i < 4; ++i) ids[i] = id_of(vertices[i], value_of);
  if (mirrored_) std::swap(ids[2], ids[3]);
  connectivity_.insert(connectivity_.end(), ids.begin(), ids.end());
  levels_.push_back(static_cast<std::uint8_t>(level));
  if (levels_.size() == batch) flush();
}

std::int64_t MeshBuilder::id_of(Index3 p, const ValueOf& value_of) {
  std::int64_t& id = ids_.of(p);
  if (id == PointIds::none) {
    id = next_id_++;
    const std::array<double, 3> world = to_world(geometry_, p - parameters_.domain().first());
    coordinates_.insert(coordinates_.end(), world.begin(), world.end());
    const std::byte* value = value_of(p);
    values_.insert(values_.end(), value, value + size_of(parameters_.type));
  }
  return id;
}

void MeshBuilder::flush() {
  sink_.add_points(coordinates_, values_);
  sink_.add_tetrahedra(connectivity_, levels_);
  coordinates_.clear();
  values_.clear();
  connectivity_.clear();
  levels_.clear();
}

}  // namespace tagrid
