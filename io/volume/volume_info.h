// The description of a volume, without its samples.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "io/metadata/metadata.h"
#include "stages/grid/box.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// A .tag file has no more volumes.
inline constexpr int most_volumes = 10'000;

struct VolumeInfo {
  /// Of several volumes: dims.z is the number of the slices of all of them.
  Index3 dims;
  SampleType type = SampleType::uint8;
  /// All else that is known of the volume.
  Metadata metadata = {};
  /// Volumes of the same size, one after the other along z; see one_of_volumes().
  std::int64_t volumes = 1;

  const Geometry& geometry() const { return metadata.geometry(); }
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
struct KnownVolume;

struct SourceDescription {
  SourceDescription() = default;
  explicit SourceDescription(const std::optional<RawDescription>& description,
                             std::optional<std::string> grid = {})
      : raw(description), vdb_grid(std::move(grid)) {}

  std::optional<RawDescription> raw;
  std::optional<GivenSpacing> spacing;
  std::optional<std::string> vdb_grid;  ///< The name of a grid, if an OpenVDB file has several.
  std::optional<std::string> from;    ///< The name of the format, if the content of the file does not say it.
  std::optional<std::string> series;  ///< The name or the number of one of several series in a folder.
  /// Without a series: every_volume is meant where the format of the file can give all volumes at once, as
  /// VolumeInfo::volumes.
  bool all_volumes = false;
  bool gaps_ok = false;                ///< Missing slice numbers are not an error.
  bool data_outside = false;           ///< A header may name files outside of its directory.
  std::optional<std::string> dataset;  ///< The path of the data set in a file of several.
  /// Bytes of memory that a reader program may take while it describes the volume.
  std::uint64_t reader_memory = most_first_memory;
  /// What is known of this very volume, if it was opened a moment ago: opening it need not describe it again, unless
  /// its files have changed since. See known_volume().
  std::shared_ptr<const KnownVolume> known = nullptr;
};

/// The bytes of a volume's samples; nothing if a size is not positive, or for 2^62 or more bytes.
std::optional<std::uint64_t> sample_bytes(const Index3& dims, SampleType type);

}  // namespace tagrid
