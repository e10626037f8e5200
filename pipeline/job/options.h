// The settings of an encoding, as the user gives them.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// The settings by name and in words. Records of runs use these names, too.
namespace setting {
inline constexpr Setting grid_only = {"grid-only", "the grid alone"};
inline constexpr Setting grid = {"grid", "the origin of the grid"};
inline constexpr Setting max_error = {"max-error", "the largest error"};
inline constexpr Setting relative_error = {"relative-error", "the largest error relative to the range"};
inline constexpr Setting psnr = {"psnr", "the PSNR"};
inline constexpr Setting ratio = {"ratio", "the ratio"};
inline constexpr Setting bits = {"bits", "the number of bits a voxel"};
inline constexpr Setting surface_error = {"surface-error", "the bound of the active points"};
inline constexpr Setting mesh_error = {"mesh-error", "the bound of the mesh"};
inline constexpr Setting threshold = {"threshold", "the thresholds"};
inline constexpr Setting effort = {"effort", "the effort"};
inline constexpr Setting accuracy = {"accuracy", "the accuracy"};
inline constexpr Setting cube = {"cube", "the edge of a root cube"};
inline constexpr Setting brick = {"brick", "the edge of a brick"};
inline constexpr Setting lead = {"lead", "the planes of padding before the first sample"};
inline constexpr Setting max_level = {"max-level", "the highest level"};
inline constexpr Setting range = {"range", "the value range"};
inline constexpr Setting overviews = {"overviews", "the overviews"};
inline constexpr Setting field_scale = {"field-scale", "the field scale"};
inline constexpr Setting parity = {"parity", "the parity"};
}  // namespace setting

/// A maximum error, or a step of a transform, that follows from the samples.
struct ErrorRule {
  enum class Kind {
    noise,     ///< a multiple of the standard deviation of the noise
    relative,  ///< a fraction of the range of the samples: max - min
    psnr,      ///< what takes the fewest bytes and has at least this PSNR, in dB; with max_error, both hold
    ratio,     ///< what has the largest PSNR in this part of the bytes of the samples: 10 is a tenth
    bits,      ///< the same in so many bits a sample
  };
  Kind kind = Kind::noise;
  double value = 0;

  /// True if it is found by trial encodings, in which a step of a transform takes part.
  bool is_tried() const { return kind >= Kind::psnr; }
  bool is_size() const { return kind == Kind::ratio || kind == Kind::bits; }
  friend bool operator==(const ErrorRule&, const ErrorRule&) = default;
};

/// The setting that a rule is given by.
const Setting& setting_of(ErrorRule::Kind kind);

/// The factors of the overviews of a volume, if none are given: 4, 16, 64, ... until the longest axis has at
/// most 256 samples; none if the longest axis of the volume has at most 512.
std::vector<int> factors_for(const Index3& dims);
/// "none" or "4,16".
std::string text_of(const std::vector<int>& factors);

struct EncodeOptions {
  bool strip = false;  ///< The file keeps only what is needed to understand the samples; see stripped().
  bool grid_only = false;
  /// If not given, stored, but derived with a PSNR or a size, where the grid would take most of the bytes.
  std::optional<GridOrigin> grid;
  std::optional<double> max_error;      ///< voxels: 0 if not given; grid: no bound if not given
  std::optional<ErrorRule> error_rule;  ///< instead of max_error, or a PSNR besides it; see settle()
  std::optional<double> surface_error;  ///< bound of active voxels, below max_error
  std::optional<double> mesh_error;     ///< bound of the mesh: of its piecewise linear field
  std::vector<double> thresholds;       ///< no voxel changes its side of these; increasing
  int accuracy = 20;                    ///< m
  int cube_size = 32;                   ///< S
  std::optional<int> max_level;         ///< for a limited run
  std::optional<int>
      brick_edge;  ///< in root cubes; if not given, max(2, 64 / S), with a PSNR or a size max(2, 128 / S)
  int lead = 1;    ///< planes of padding before the first sample, 0 or 1; see Domain
  Effort effort = Effort::normal;  ///< affects only voxels of 8 and 16 bits
  std::optional<std::pair<double, double>> range;
  bool range_from_data = false;         ///< needs a separate pass over the volume; files only
  std::optional<double> field_scale;    ///< lambda itself, instead of a range
  std::optional<std::uint32_t> parity;  ///< share of the file, in thousandths of a per cent; see io/parity
  /// The factors of the overviews, increasing; if not given, as large volumes need them: factors_for().
  std::optional<std::vector<int>> overviews;

  /// True if a transform may be best. It knows one bound of the voxels.
  bool may_be_transformed() const { return error_rule && error_rule->is_tried() && !mesh_error; }

  /// Throws UsageError if values are out of range or cannot be combined.
  void validate() const;
};

/// What the bound of voxels follows from, as text: the rule, and the largest error beside it. The same for equal ones
/// only. REQUIRES: options.error_rule.
std::string text_of_rule(const EncodeOptions& options);

}  // namespace tagrid
