// What is known of a volume besides its samples.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "stages/grid/box.h"
#include "stages/volume/sample_type.h"

namespace tagrid {

/// Where the samples lie in the world, as far as the source said. Units are those of the source.
struct Geometry {
  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

  /// Distance of neighbouring samples per axis (x, y, z); NaN where it is not known. With directions: their
  /// lengths.
  std::array<double, 3> spacing = {unknown, unknown, unknown};
  /// World position of sample (0, 0, 0).
  std::array<double, 3> origin = {0, 0, 0};
  /// directions[axis] is the way in the world from a sample to the next one along `axis`.
  std::array<std::array<double, 3>, 3> directions = {};
  /// What the coordinates are called, such as "left-posterior-superior" or "LPS"; "" where that is not known.
  std::string space;
  /// Of the axes, where there are no directions, else of the coordinates; "" where one is not known.
  std::array<std::string, 3> units;
  bool has_spacing = false;  ///< The source gave spacings, or directions.
  bool has_origin = false;
  bool has_directions = false;
};

/// World position of a lattice point, which may lie outside the volume. An unknown spacing counts as 1.
std::array<double, 3> to_world(const Geometry& geometry, const Index3& point);

/// Whether the directions of the axes have a negative determinant (or an odd number of negative spacings), so
/// that the volume is mirrored in the world.
bool is_mirrored(const Geometry& geometry);

/// Of the directions: 0 where they do not span a volume, negative where they mirror it.
double determinant(const std::array<std::array<double, 3>, 3>& directions);

struct VolumeInfo {
  Index3 dims;
  SampleType type = SampleType::uint8;
  /// geometry_of(nrrd_fields), kept for convenience.
  Geometry geometry;
  /// The lines of the source's NRRD header, verbatim and in order, each with '\n', that do not say how
  /// samples are stored (type, dimension, sizes, encoding, endian, data file, skips): content, space and its
  /// directions, spacings, units, kinds, key:=value pairs, comments. A writer puts them back.
  std::string nrrd_fields;
};

/// "3 x 4 x 5 int16", for messages.
std::string described(const Index3& dims, SampleType type);

/// How the samples of a headerless file lie in it, x fastest.
struct RawDescription {
  Index3 dims;
  SampleType type = SampleType::uint8;
  std::optional<bool> big_endian;  ///< little where it is not said
  std::optional<std::array<double, 3>> spacing;
  /// Bytes before the first sample.
  std::uint64_t offset = 0;
};

/// What has to be said of a volume that does not say it itself.
struct SourceDescription {
  SourceDescription() = default;
  explicit SourceDescription(const std::optional<RawDescription>& description, std::string grid = "")
      : raw(description), vdb_grid(std::move(grid)) {}

  std::optional<RawDescription> raw;
  std::string vdb_grid;  ///< Of an OpenVDB file: the name of the grid; "": it has only one.
};

/// Bytes of a volume's samples, or nothing where a size is not positive or the product is 2^62 or more.
std::optional<std::uint64_t> sample_bytes(const Index3& dims, SampleType type);

}  // namespace tagrid
