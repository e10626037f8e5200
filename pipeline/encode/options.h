// What a caller asks of an encoding, and the parameters that follow from it.
#pragma once

#include <optional>
#include <utility>

#include "io/files/errors.h"
#include "io/volume/volume_source.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {

/// What may be asked, by name and in words. Records of runs have the names, too.
namespace setting {
inline constexpr Setting grid_only = {"grid-only", "the grid alone"};
inline constexpr Setting max_error = {"max-error", "the largest error"};
inline constexpr Setting surface_error = {"surface-error", "the bound of the active points"};
inline constexpr Setting mesh_error = {"mesh-error", "the bound of the mesh"};
inline constexpr Setting effort = {"effort", "the effort"};
inline constexpr Setting accuracy = {"accuracy", "the accuracy"};
inline constexpr Setting cube = {"cube", "the edge of a root cube"};
inline constexpr Setting brick = {"brick", "the edge of a brick"};
inline constexpr Setting max_level = {"max-level", "the highest level"};
inline constexpr Setting range = {"range", "the value range"};
inline constexpr Setting field_scale = {"field-scale", "the field scale"};
}  // namespace setting

struct EncodeOptions {
  bool grid_only = false;
  std::optional<double> max_error;      ///< voxels: 0 where not given; grid: no bound where not given
  std::optional<double> surface_error;  ///< bound of active voxels, below max_error
  std::optional<double> mesh_error;     ///< bound of the mesh: of its piecewise linear field
  int accuracy = 20;                    ///< m
  int cube_size = 32;                   ///< S
  std::optional<int> max_level;         ///< a limited run
  std::optional<int> brick_edge;        ///< in root cubes; max(2, 64 / S) where not given
  Effort effort = Effort::normal;       ///< matters to voxels of 8 and 16 bits only
  std::optional<std::pair<double, double>> range;
  bool range_from_data = false;       ///< a pass of its own over the volume; files only
  std::optional<double> field_scale;  ///< lambda itself, instead of a range

  /// Throws UsageError where values are out of range or do not go together.
  void validate() const;
};

/// The parameters of the encoding of a volume, without what may depend on its samples: the value
/// range and the field scale. Throws as resolve() does.
CodingParameters parameters_but_scale(const EncodeOptions& options, const VolumeInfo& info);

/// Whether resolve() reads the whole volume, for the value range.
bool takes_range_from_data(const EncodeOptions& options, const VolumeSource& source);

/// The parameters of the encoding of `reader`'s volume. Reads the whole volume once, and rewinds it, where
/// the range is taken from the data. Throws UsageError for what the options and the volume do not allow.
CodingParameters resolve(const EncodeOptions& options, VolumeSource& source);

/// The same of samples that whoever has them may know more of: `range_of_data` is theirs, where the options
/// leave it open; the usual one of the type where it is not given. `name` is the volume's, for messages.
CodingParameters resolve(const EncodeOptions& options, const VolumeInfo& info,
                         const std::string& name = "this volume",
                         std::optional<std::pair<double, double>> range_of_data = {});

}  // namespace tagrid
