// The settings of an encoding, and the parameters that follow from them.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "io/files/errors.h"
#include "io/volume/volume_source.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {

/// The settings by name and in words. Records of runs use these names, too.
namespace setting {
inline constexpr Setting grid_only = {"grid-only", "the grid alone"};
inline constexpr Setting grid = {"grid", "the origin of the grid"};
inline constexpr Setting max_error = {"max-error", "the largest error"};
inline constexpr Setting relative_error = {"relative-error", "the largest error relative to the range"};
inline constexpr Setting psnr = {"psnr", "the PSNR"};
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

/// A largest error that follows from the samples.
struct ErrorRule {
  enum class Kind {
    noise,     ///< a multiple of the standard deviation of the noise
    relative,  ///< a part of the range of the samples: max - min
    psnr,      ///< the loosest with which the PSNR is at least this, in dB
  };
  Kind kind = Kind::noise;
  double value = 0;
  friend bool operator==(const ErrorRule&, const ErrorRule&) = default;
};

/// As text, the same for equal rules only.
std::string text_of(const ErrorRule& rule);

struct EncodeOptions {
  bool strip = false;  ///< The file keeps only what is needed to understand the samples; see stripped().
  bool grid_only = false;
  GridOrigin grid = GridOrigin::stored;
  std::optional<double> max_error;      ///< voxels: 0 if not given; grid: no bound if not given
  std::optional<ErrorRule> error_rule;  ///< instead of max_error; see with_plain_bound()
  std::optional<double> surface_error;  ///< bound of active voxels, below max_error
  std::optional<double> mesh_error;     ///< bound of the mesh: of its piecewise linear field
  int accuracy = 20;                    ///< m
  int cube_size = 32;                   ///< S
  std::optional<int> max_level;         ///< for a limited run
  std::optional<int> brick_edge;        ///< in root cubes; max(2, 64 / S) if not given
  Effort effort = Effort::normal;       ///< affects only voxels of 8 and 16 bits
  std::optional<std::pair<double, double>> range;
  bool range_from_data = false;       ///< needs a separate pass over the volume; files only
  std::optional<double> field_scale;  ///< lambda itself, instead of a range

  /// Throws UsageError if values are out of range or cannot be combined.
  void validate() const;
};

/// Options whose bounds, range and scale are for samples, where those given are for values. Throws UsageError if they bound
/// errors of values and nobody knows which values the samples of `source` stand for.
struct OptionsForSamples {
  EncodeOptions options;
  std::string reason;  ///< how a bound follows from that of values; "" if it is the same
};
OptionsForSamples for_samples(const EncodeOptions& options, const SourceFacts& source);

/// The metadata of the source that the file keeps.
std::string kept_fields(const EncodeOptions& options, const VolumeInfo& info);

/// The parameters of the encoding of a volume, except those that may depend on its samples: the value range
/// and the field scale. Throws as resolve() does.
CodingParameters parameters_but_scale(const EncodeOptions& options, const VolumeInfo& info);

/// The lowest and the highest finite sample; nothing if none is finite. Reads the whole volume and rewinds it. Throws
/// UsageError if that is not possible.
std::optional<std::pair<double, double>> range_of_data(VolumeSource& source);

/// True if resolve() reads the whole volume to find the value range.
bool takes_range_from_data(const EncodeOptions& options, const VolumeSource& source);

/// The parameters of the encoding of `source`'s volume. REQUIRES: no error_rule. If the range is taken from the data, it reads the
/// whole volume once and rewinds it. Throws UsageError if the volume does not allow the options.
CodingParameters resolve(const EncodeOptions& options, VolumeSource& source);

/// The same for samples that the caller has. `range_of_data` is used if the options leave the range open;
/// without it, the usual range of the type. `name` is that of the volume, for messages.
CodingParameters resolve(const EncodeOptions& options, const VolumeInfo& info,
                         const std::string& name = "this volume",
                         std::optional<std::pair<double, double>> range_of_data = {});

}  // namespace tagrid
