#include "io/vdb/transform.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/files/text.h"
#include "io/vdb/format.h"

namespace tagrid {
namespace {

constexpr std::string_view origin_key = "vdb_origin:=", grid_key = "vdb_grid:=",
                           background_key = "vdb_background:=";

using Vector = std::array<double, 3>;

Vector read_vector(VdbBytes& bytes) {
  Vector v;
  for (double& number : v) number = bytes.number<double>();
  return v;
}

VdbTransform scaled(const Vector& scale) {
  VdbTransform transform;
  for (std::size_t axis = 0; axis < 3; ++axis) transform.directions[axis][axis] = scale[axis];
  return transform;
}

/// A matrix of 4 x 4 for row vectors.
VdbTransform read_matrix(VdbBytes& bytes) {
  VdbTransform transform;
  for (std::size_t row = 0; row < 4; ++row) {
    (row < 3 ? transform.directions[row] : transform.origin) = read_vector(bytes);
    if (bytes.number<double>() != (row < 3 ? 0 : 1)) bytes.fail("the matrix of its transform is not affine");
  }
  return transform;
}

std::optional<VdbTransform> read_map(VdbBytes& bytes, int depth) {
  const std::string map = bytes.text(vdb::longest_name);
  // Numbers derived from the scale follow it.
  if (map == "ScaleMap" || map == "UniformScaleMap") {
    const VdbTransform transform = scaled(read_vector(bytes));
    bytes.skip(12 * sizeof(double));
    return transform;
  }
  if (map == "ScaleTranslateMap" || map == "UniformScaleTranslateMap") {
    const Vector translation = read_vector(bytes);
    VdbTransform transform = scaled(read_vector(bytes));
    bytes.skip(12 * sizeof(double));
    transform.origin = translation;
    return transform;
  }
  if (map == "TranslationMap") {
    VdbTransform transform = scaled({1, 1, 1});
    transform.origin = read_vector(bytes);
    return transform;
  }
  if (map == "AffineMap" || map == "UnitaryMap") return read_matrix(bytes);
  if (map == "NonlinearFrustumMap" && depth == 0) {
    bytes.skip(8 * sizeof(double));  // its box, taper and depth
    read_map(bytes, depth + 1);
    return std::nullopt;
  }
  bytes.fail("its transform is " + quoted(map) + ", which is not supported");
}

bool is_finite(const Vector& v) {
  return std::all_of(v.begin(), v.end(), [](double number) { return std::isfinite(number); });
}

bool is_diagonal(const VdbTransform& t) {
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column)
      if (row != column && t.directions[row][column] != 0) return false;
  return true;
}

Vector position_of(const VdbTransform& t, const Index3& voxel) {
  Vector position = t.origin;
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < 3; ++i)
      position[i] += static_cast<double>(voxel[axis]) * t.directions[static_cast<std::size_t>(axis)][i];
  return position;
}

/// True if a line of a header can hold the text as it is.
bool fits_line(std::string_view text) {
  return !text.empty() && std::none_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) < 32 || c == '\\' || c == 127;
  });
}

std::string vector_text(const Vector& v) { return fmt::format("({},{},{})", v[0], v[1], v[2]); }

}  // namespace

std::optional<VdbTransform> read_vdb_transform(VdbBytes& bytes) {
  const auto transform = read_map(bytes, 0);
  if (!transform) return transform;
  for (const Vector& direction : transform->directions)
    if (!is_finite(direction)) bytes.fail("its transform has numbers that are not finite");
  if (!is_finite(transform->origin)) bytes.fail("its transform has numbers that are not finite");
  if (determinant(transform->directions) == 0) bytes.fail("the matrix of its transform is singular");
  return transform;
}

void put_vdb_transform(FieldWriter& out, const VdbTransform& transform) {
  if (!is_diagonal(transform)) {
    put_vdb_text(out, "AffineMap");
    for (std::size_t row = 0; row < 4; ++row) {
      for (const double number : row < 3 ? transform.directions[row] : transform.origin) out.put(number);
      out.put(row < 3 ? 0.0 : 1.0);
    }
    return;
  }
  const Vector scale = {transform.directions[0][0], transform.directions[1][1], transform.directions[2][2]};
  const bool uniform = scale[0] == scale[1] && scale[0] == scale[2];
  put_vdb_text(out, uniform ? "UniformScaleTranslateMap" : "ScaleTranslateMap");
  for (const double number : transform.origin) out.put(number);
  for (const double s : scale) out.put(s);
  for (const double s : scale) out.put(std::abs(s));
  for (const double s : scale) out.put(1 / s);
  for (const double s : scale) out.put(1 / s * (1 / s));
  for (const double s : scale) out.put(1 / s / 2);
}

VdbTransform vdb_transform_of(const Geometry& geometry, const Index3& low) {
  VdbTransform transform;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (geometry.has_directions)
      transform.directions[axis] = geometry.directions[axis];
    else
      transform.directions[axis][axis] = spacing_or_1(geometry, axis);
  }
  transform.origin = geometry.origin;
  transform.origin = position_of(transform, {-low.x, -low.y, -low.z});
  return transform;
}

std::string nrrd_fields_of(const std::optional<VdbTransform>& transform, const VdbPlace& place) {
  std::string fields;
  if (transform) {
    fields = "space dimension: 3\nspace directions:";
    for (const Vector& direction : transform->directions) fields.append(" ").append(vector_text(direction));
    fields += fmt::format("\nspace origin: {}\n", vector_text(position_of(*transform, place.low)));
  }
  fields += fmt::format("{}{} {} {}\n", origin_key, place.low.x, place.low.y, place.low.z);
  if (fits_line(place.grid)) fields += fmt::format("{}{}\n", grid_key, place.grid);
  if (place.background) fields += fmt::format("{}{}\n", background_key, *place.background);
  return fields;
}

VdbPlace vdb_place_of(std::string_view nrrd_fields) {
  constexpr double farthest = 1 << 30;
  VdbPlace place;
  while (!nrrd_fields.empty()) {
    const std::string_view line = take_line(nrrd_fields);
    if (line.starts_with(grid_key)) place.grid = line.substr(grid_key.size());
    if (line.starts_with(background_key)) place.background = number_of(line.substr(background_key.size()));
    if (!line.starts_with(origin_key)) continue;
    const auto words = words_of(line.substr(origin_key.size()));
    for (std::size_t i = 0; i < 3 && words.size() == 3; ++i) {
      const auto number = number_of(words[i]);
      if (number && std::abs(*number) <= farthest)
        place.low[static_cast<int>(i)] = static_cast<std::int64_t>(*number);
    }
  }
  return place;
}

}  // namespace tagrid
