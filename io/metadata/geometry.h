// The position of samples in the world.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <string>

#include "stages/grid/box.h"

namespace tagrid {

/// The position of the samples in the world, as far as the source gives it. Units are those of the source.
struct Geometry {
  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

  /// Distances between neighboring samples (x, y, z), NaN if unknown; the lengths of directions.
  std::array<double, 3> spacing = {unknown, unknown, unknown};
  /// World position of sample (0, 0, 0); without has_origin, in the entire volume with samples 1 apart.
  std::array<double, 3> origin = {0, 0, 0};
  /// directions[axis] is the vector in the world from one sample to the next one along `axis`.
  std::array<std::array<double, 3>, 3> directions = {};
  /// The name of the coordinate system, such as "left-posterior-superior" or "LPS"; "" if unknown.
  std::string space;
  /// The units of the axes if there are no directions, otherwise those of the coordinates; "" if unknown.
  std::array<std::string, 3> units;
  bool has_spacing = false;  ///< The source gave spacings or directions.
  bool has_origin = false;
  bool has_directions = false;
};

/// The spacing along an axis; an unknown one counts as 1.
double spacing_or_1(const Geometry& geometry, std::size_t axis);
/// True if the source did not give spacings along all axes.
bool has_unknown_spacing(const Geometry& geometry);

/// World position of a lattice point, which may lie outside the volume. An unknown spacing counts as 1.
std::array<double, 3> to_world(const Geometry& geometry, const Index3& point);
/// The same for a place between lattice points, in samples along each axis.
std::array<double, 3> to_world(const Geometry& geometry, const std::array<double, 3>& place);

/// True if the determinant of the axis directions is negative (or the number of negative spacings is odd), so
/// that the volume is mirrored in the world.
bool is_mirrored(const Geometry& geometry);

/// The determinant of the directions: 0 if they do not span a volume, negative if they mirror it.
double determinant(const std::array<std::array<double, 3>, 3>& directions);

}  // namespace tagrid
