// Bounds on errors: of voxels, of active voxels, of the mesh, and of stored points; and how a bound is kept.
//
// The header of a file has bounds as requested (coding_parameters.h). The coders of 8 and 16 bits take them
// as integers, and Quantizer keeps them. The coder of wide types checks every sample
// (stages/values/wide/codec.cpp).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "stages/grid/box.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/filter_fit.h"

namespace tagrid {

/// True if `e` can bound an error: a finite number from 0, in sample units. An absent bound is nothing in
/// EncodeOptions, and -1 in CodingParameters and in the header: see docs/dev/decisions/0020-bounds.md.
inline bool is_bound(double e) { return e >= 0 && std::isfinite(e); }

/// A bound as an integer. A bound larger than the range of the type becomes that range.
template <class T>
std::int64_t integer_bound(double bound) {
  constexpr double widest =
      static_cast<double>(std::numeric_limits<T>::max()) - std::numeric_limits<T>::min();
  return bound < 0 ? -1 : static_cast<std::int64_t>(std::min(bound, widest));
}

/// Largest absolute error of a voxel, in sample units. If surface_error >= 0, it applies to active points and
/// max_error to the others; if surface_error < 0, max_error applies to all.
struct VoxelBounds {
  std::int64_t max_error = 0;
  std::int64_t surface_error = -1;
};

/// The same for wide types; 0 keeps every bit.
struct WideBounds {
  double max_error = 0;
  double surface_error = -1;
};

/// Keeps the bound E: quantization with the step 2E + 1, since every difference is within E of a multiple of
/// that. The lanes of stages/values/wavefront do the same in vectors (wave.h, LaneBound).
struct Quantizer {
  std::int64_t error = 0;
  std::int64_t step = 1;
  std::uint64_t reciprocal = (std::uint64_t{1} << 40) + 1;

  Quantizer() = default;
  /// REQUIRES: 0 <= max_error <= 65535. Then the division by multiplication below is exact.
  explicit Quantizer(std::int64_t max_error)
      : error(max_error),
        step(2 * max_error + 1),
        reciprocal((std::uint64_t{1} << 40) / static_cast<std::uint64_t>(step) + 1) {}

  std::int32_t operator()(std::int32_t difference) const {
    const auto magnitude = static_cast<std::uint64_t>(difference < 0 ? -difference : difference);
    const auto q =
        static_cast<std::int32_t>(((magnitude + static_cast<std::uint64_t>(error)) * reciprocal) >> 40);
    return difference < 0 ? -q : q;
  }
};

/// The quantizers of inactive and of active points. Errors beyond the range of the type count as that range.
inline std::array<Quantizer, 2> quantizers(const VoxelBounds& bounds) {
  const auto limited = [](std::int64_t e) { return Quantizer(std::clamp<std::int64_t>(e, 0, 65535)); };
  const Quantizer other = limited(bounds.max_error);
  return {other, bounds.surface_error < 0 ? other : limited(bounds.surface_error)};
}

/// What the encoder and the decoder of a brick's voxels both know.
template <class Bounds>
struct BrickOfVoxels {
  Box owned;  ///< of the voxels; not empty
  /// Of a box that contains `owned`; only needed with a surface_error.
  const LatticeBits* activity = nullptr;
  Bounds bounds;
  Effort effort = Effort::normal;
  double transform_step = 0;   ///< see CodingParameters; 0: none
  FilterWeights filter{};      ///< see CodingParameters
  FilterSums* sums = nullptr;  ///< see TransformBrick
};
using VoxelBrick = BrickOfVoxels<VoxelBounds>;

}  // namespace tagrid
