// The parameters in the header of a .tag file that say how its bricks are coded. Every brick is a function of
// these parameters and the samples around it.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "stages/grid/brick_grid.h"
#include "stages/sample/sample_type.h"
#include "stages/sample/thresholds.h"

namespace tagrid {

/// Numbers are part of the file format: never renumber.
enum class FileMode : std::uint8_t {
  voxels = 0,  ///< activity, and every voxel within a bound
  grid = 1,    ///< activity, and the values of the active points; voxels are interpolated
};

/// Where the grid of a file with voxels is. The numbers are part of the file format, as above.
enum class GridOrigin : std::uint8_t {
  stored = 0,   ///< in the bricks: the grid of the original samples
  derived = 1,  ///< not in the file: computed from the decoded samples on demand
  implied = 2,  ///< the grid of the original samples, which the decoded ones are; its points are counted
};
/// The origins that a user chooses from. The grid of a lossless file that is to be stored is implied.
inline constexpr std::array<std::string_view, 2> grid_origin_names = {"stored", "derived"};
inline std::string_view name_of(GridOrigin origin) {
  return grid_origin_names[origin == GridOrigin::derived ? 1 : 0];
}

/// How much time may be spent on making voxels of 8 or 16 bits small; it affects nothing else. The numbers
/// are part of the file format, as above.
enum class Effort : std::uint8_t { normal = 0, fast = 1, best = 2 };
inline constexpr std::array<std::string_view, 3> effort_names = {"default", "fast", "best"};
inline std::string_view name_of(Effort effort) { return effort_names[static_cast<std::size_t>(effort)]; }

inline constexpr int max_accuracy = 1'000'000;

/// Steps of a transform of integers are multiples of this part of a sample, up to the largest number of them.
inline constexpr double least_transform_step = 1.0 / 64;
inline constexpr std::uint32_t largest_transform_step = (1u << 23) - 1;

/// Weights of the filter after a transform, in 2^-10: see stages/values/transform/filter.h. All 0: there is none.
inline constexpr std::size_t filter_weights = 24;
inline constexpr std::int16_t most_filter_weight = 2047;
using FilterWeights = std::array<std::int16_t, filter_weights>;
constexpr bool is_filter(const FilterWeights& weights) { return weights != FilterWeights{}; }

/// True if a volume may have these sizes: 1 .. 2^31 along each axis, and at most 2^58 samples, so that the
/// number of bytes fits for every type.
constexpr bool is_volume_size(const Index3& dims) {
  constexpr std::int64_t largest = std::int64_t{1} << 31;
  constexpr std::int64_t most = std::int64_t{1} << 58;
  for (int axis = 0; axis < 3; ++axis)
    if (dims[axis] < 1 || dims[axis] > largest) return false;
  return dims.x * dims.y <= most / dims.z;
}

/// The bound that is kept for samples of a type: errors of integers are whole numbers.
inline double kept_bound(double bound, SampleType type) {
  return is_float_type(type) ? bound : std::floor(bound);
}

/// The step of a transform that a file can hold, next to a positive one: a multiple of 2^-6 for integers; for floats, a
/// binary32 from 2^-100 to 2^100.
inline double kept_step(double step, SampleType type) {
  if (is_float_type(type)) return static_cast<float>(std::clamp(step, 0x1p-100, 0x1p100));
  return std::clamp(std::round(step / least_transform_step), 1.0, double{largest_transform_step}) *
         least_transform_step;
}

struct CodingParameters {
  Index3 dims;
  SampleType type = SampleType::uint8;
  FileMode mode = FileMode::voxels;
  Effort effort = Effort::normal;
  GridOrigin grid = GridOrigin::stored;
  int cube_size = 32;    ///< S, a power of two, 4 .. 256
  int brick_edge = 2;    ///< root cubes along the edge of a brick
  int lead = 0;          ///< planes of padding before the first sample, 0 or 1; see Domain
  int max_level = 15;    ///< no point of a higher level is marked; 3K if the run is not limited
  int accuracy = 20;     ///< m of the curvature criterion
  double range_low = 0;  ///< the value range that the field scale was derived from; low == high: none
  double range_high = 0;
  double field_scale = 0;  ///< lambda: voxels per unit of field value

  /// Largest |decoded - original| of any voxel; negative: no bound (grid mode only).
  double max_error = 0;
  /// In voxels mode: the tighter bound of active voxels; negative: none.
  double surface_error = -1;
  /// M: no sample is further than this from the piecewise linear field of the mesh; negative: no such bound.
  double mesh_error = -1;
  /// E_n: largest error of a stored point value in grid mode.
  double point_error = 0;
  /// The step of quantization of a wavelet, for low rates; 0: there is none. Only for voxels with one bound. See
  /// kept_step() and stages/values/transform.
  double transform_step = 0;
  /// Only with a step.
  FilterWeights filter{};
  /// Samples of the type, increasing, above its lowest one. In voxels mode: decoded samples are on their sides of these.
  Thresholds thresholds{};

  /// True if the interpolation has a bound, so that the mesh criterion marks points.
  bool bounds_interpolation() const { return mesh_error >= 0 || (mode == FileMode::grid && max_error >= 0); }
  /// True if the values of the mesh at voxels differ from the original ones, so that a brick must be coded to
  /// know them.
  bool mesh_has_coded_values() const { return mode == FileMode::voxels && max_error > 0; }

  /// True if every sample is decoded exactly. Fractions of a bound have no effect on integers.
  bool is_exact() const { return kept_bound(max_error, type) == 0; }

  /// True if bricks have the activity of their grid. Otherwise, it is computed from the decoded samples.
  bool stores_activity() const { return grid == GridOrigin::stored; }
  /// True if the grid is that of the original samples, so that the encoder computes it and counts its points.
  bool counts_points() const { return grid != GridOrigin::derived; }
  /// True if the decoded samples alone determine the grid of the original: the criterion marks the same points.
  bool implies_grid() const {
    return mode == FileMode::voxels && is_exact() && surface_error < 0 && mesh_error < 0;
  }

  /// True if every `step`-th sample along each axis can be decoded alone: for powers of two up to a root cube.
  bool has_step(std::int64_t step) const {
    return step >= 1 && step <= cube_size && std::has_single_bit(static_cast<std::uint64_t>(step));
  }

  Domain domain() const { return {dims, cube_size, lead}; }
  BrickGrid bricks() const { return {domain(), brick_edge}; }
};

}  // namespace tagrid
