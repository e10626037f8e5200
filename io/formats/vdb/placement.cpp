#include "io/formats/vdb/placement.h"

#include <fmt/format.h>

#include <cmath>

#include "io/metadata/lengths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::string_view origin_key = "vdb_origin", grid_key = "vdb_grid", class_key = "vdb_class",
                           background_key = "vdb_background";

using Vector = std::array<double, 3>;

Vector row_of(const openvdb::Mat4d& matrix, int row) {
  return {matrix[row][0], matrix[row][1], matrix[row][2]};
}

/// The origin moved by a number of voxels along each direction.
Vector moved(const openvdb::Mat4d& matrix, const Index3& voxels) {
  Vector position = row_of(matrix, 3);
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < 3; ++i)
      position[i] += static_cast<double>(voxels[axis]) * row_of(matrix, axis)[i];
  return position;
}

bool is_diagonal(const openvdb::Mat4d& matrix) {
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      if (row != column && matrix[row][column] != 0) return false;
  return true;
}

openvdb::math::MapBase::Ptr map_of(const openvdb::Mat4d& matrix) {
  using namespace openvdb::math;
  if (!is_diagonal(matrix)) return std::make_shared<AffineMap>(matrix);
  const openvdb::Vec3d scale(matrix[0][0], matrix[1][1], matrix[2][2]),
      origin(matrix[3][0], matrix[3][1], matrix[3][2]);
  if (scale[0] == scale[1] && scale[0] == scale[2])
    return std::make_shared<UniformScaleTranslateMap>(scale[0], origin);
  return std::make_shared<ScaleTranslateMap>(scale, origin);
}

}  // namespace

KeyValues pairs_of(const VdbPlace& place) {
  KeyValues pairs = {{origin_key.data(), fmt::format("{} {} {}", place.low.x, place.low.y, place.low.z)}};
  if (!place.grid.empty()) pairs.emplace_back(grid_key, place.grid);
  if (!place.grid_class.empty()) pairs.emplace_back(class_key, place.grid_class);
  if (place.background) pairs.emplace_back(background_key, fmt::format("{}", *place.background));
  return pairs;
}

KeyValues other_pairs_of(const Metadata& metadata) {
  KeyValues pairs = pairs_without_places(metadata);
  std::erase_if(pairs, [](const auto& pair) { return pair.first.starts_with("vdb_"); });
  return pairs;
}

VdbPlace vdb_place_of(const Metadata& metadata) {
  constexpr double farthest = 1 << 30;
  VdbPlace place;
  for (const auto& [key, value] : metadata.pairs()) {
    if (key == grid_key) place.grid = value;
    if (key == class_key) place.grid_class = value;
    if (key == background_key) place.background = number_of(value);
    if (key != origin_key) continue;
    const auto words = words_of(value);
    for (std::size_t i = 0; i < 3 && words.size() == 3; ++i) {
      const auto number = number_of(words[i]);
      if (number && std::abs(*number) <= farthest)
        place.low[static_cast<int>(i)] = static_cast<std::int64_t>(*number);
    }
  }
  return place;
}

std::optional<openvdb::Mat4d> matrix_of(const openvdb::math::Transform& transform) {
  if (!transform.isLinear()) return std::nullopt;
  return transform.baseMap()->getAffineMap()->getMat4();
}

openvdb::Mat4d matrix_of(const Geometry& of_volume, const Index3& low) {
  const Geometry geometry = in_one_unit(of_volume);
  openvdb::Mat4d matrix = openvdb::Mat4d::identity();
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    for (int i = 0; i < 3; ++i)
      matrix[axis][i] = geometry.has_directions ? geometry.directions[a][static_cast<std::size_t>(i)]
                        : axis == i             ? spacing_or_1(geometry, a)
                                                : 0;
    matrix[3][axis] = geometry.origin[a];
  }
  const Vector origin = moved(matrix, {-low.x, -low.y, -low.z});
  for (int i = 0; i < 3; ++i) matrix[3][i] = origin[static_cast<std::size_t>(i)];
  return matrix;
}

openvdb::math::Transform::Ptr transform_of(const Geometry& geometry, const Index3& low) {
  return std::make_shared<openvdb::math::Transform>(map_of(matrix_of(geometry, low)));
}

Geometry geometry_of(const openvdb::Mat4d& matrix, const Index3& low) {
  Geometry geometry;
  for (int axis = 0; axis < 3; ++axis)
    geometry.directions[static_cast<std::size_t>(axis)] = row_of(matrix, axis);
  geometry.origin = moved(matrix, low);
  geometry.has_directions = geometry.has_origin = true;
  return geometry;
}

}  // namespace tagrid
