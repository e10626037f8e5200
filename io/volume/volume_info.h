// The description of a volume, without its samples.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "stages/grid/box.h"
#include "stages/sample/sample_type.h"

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

/// What samples mean: value = slope * sample + intercept.
struct Rescale {
  double slope = 1, intercept = 0;
  std::string units = "";  ///< of the values; "" if unknown

  bool operator==(const Rescale&) const = default;
};

/// A .tag file has no more volumes.
inline constexpr int most_volumes = 10'000;

struct VolumeInfo {
  /// Of several volumes: dims.z is the number of the slices of all of them.
  Index3 dims;
  SampleType type = SampleType::uint8;
  /// geometry_of(nrrd_fields), kept for convenience.
  Geometry geometry;
  /// The lines of the source's NRRD header, verbatim and in order, each with '\n', except those that say how
  /// samples are stored (type, dimension, sizes, encoding, endian, data file, skips). They include content,
  /// space and its directions, spacings, units, kinds, key:=value pairs and comments. A writer puts them into
  /// its header.
  std::string nrrd_fields;
  /// Volumes of the same size, one after the other along z; see one_of_volumes().
  std::int64_t volumes = 1;
};

/// "3 x 4 x 5 int16", for messages.
std::string described(const Index3& dims, SampleType type);

/// The layout of the samples in a headerless file, x fastest.
struct RawDescription {
  Index3 dims;
  SampleType type = SampleType::uint8;
  std::optional<bool> big_endian;  ///< little endian if not given
  /// The number of bytes before the first sample.
  std::uint64_t offset = 0;
};

/// The distances between samples that the user gives, for files that do not state them.
struct GivenSpacing {
  std::array<double, 3> distances = {1, 1, 1};  ///< along x, y, z; above 0
  std::string unit = "";   ///< the usual name of a length: "um"; "": that of the file, if it has one
  bool overrides = false;  ///< It replaces another spacing that the file states.

  bool operator==(const GivenSpacing&) const = default;
};

/// Bytes of memory that a program for a format may take until it reports its needs, unless less is allowed.
inline constexpr std::uint64_t most_first_memory = std::uint64_t{1} << 30;

/// The series that means all volumes of a file.
inline constexpr std::string_view every_volume = "all";

/// The user's description of a volume that does not describe itself.
struct SourceDescription {
  SourceDescription() = default;
  explicit SourceDescription(const std::optional<RawDescription>& description, std::string grid = "")
      : raw(description), vdb_grid(std::move(grid)) {}

  std::optional<RawDescription> raw;
  std::optional<GivenSpacing> spacing;
  std::string vdb_grid;  ///< For an OpenVDB file, the name of the grid; "" if it has only one.
  std::string from;      ///< The name of the format; "" if the content of the file says it.
  std::string
      series;  ///< Of several series in a folder, the name or the number of one; "" if there is only one.
  /// Without a series: every_volume is meant where the format of the file can give all volumes at once, as
  /// VolumeInfo::volumes.
  bool all_volumes = false;
  bool gaps_ok = false;       ///< Missing slice numbers are not an error.
  bool data_outside = false;  ///< A header may name files outside of its directory.
  std::string dataset;  ///< The path of the data set in a file of many; "" if it is clear which one is meant.
  /// Bytes of memory that a reader program may take while it describes the volume.
  std::uint64_t reader_memory = most_first_memory;
};

/// The bytes of a volume's samples; nothing if a size is not positive, or for 2^62 or more bytes.
std::optional<std::uint64_t> sample_bytes(const Index3& dims, SampleType type);

}  // namespace tagrid
