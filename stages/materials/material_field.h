// Which material is where: a function of the position, given by samples of values or of labels.
//
// All numbers that decide are integers, or the result of single operations on floating-point numbers, so they are the
// same on every machine and in every brick.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// The number of a material.
using Material = std::uint16_t;

/// Positions in a mesh with materials count in these parts of half an edge H.
inline constexpr std::int64_t parts_per_point = std::int64_t{1} << 18;
/// Cuts count in these parts of an edge of the lattice.
inline constexpr std::int32_t cut_parts = 65536;

/// How the samples of a volume lie in the lattice of a mesh: its point p is at the sample p * step. Positions beyond
/// the volume are those of its faces.
struct SamplePlaces {
  Index3 dims;                 ///< of the volume, in samples
  std::array<double, 3> step;  ///< samples per point of the lattice

  /// The coordinate of a position, in samples. The position is below 2^53, so this is one rounding.
  double along(int axis, std::int64_t position) const {
    constexpr double scale = 1.0 / static_cast<double>(parts_per_point);
    return std::clamp(static_cast<double>(position) * scale * step[static_cast<std::size_t>(axis)], 0.0,
                      static_cast<double>(dims[axis] - 1));
  }
  /// The samples at most `reach` from any position in a box of points.
  Box around(const Box& points, double reach) const;
};

class MaterialField {
 public:
  virtual ~MaterialField() = default;

  /// The materials of every second point of a row along x, from `first` on, to every second place of `to`.
  /// REQUIRES: to.size() is odd.
  virtual void find_materials(Index3 first, std::span<Material> to) const = 0;
  /// The material at a position, in parts of the lattice.
  virtual Material at(Index3 position) const = 0;
  /// The last of the cut_parts steps from the point p towards p + direction that is still in material a, by bisection.
  /// REQUIRES: p has material a, the other end b; they differ.
  virtual std::int32_t find_cut(Index3 p, Index3 direction, Material a, Material b) const = 0;

 protected:
  /// is_first(step): whether a step is on the side of the first end.
  template <class IsFirst>
  static std::int32_t bisect(IsFirst is_first) {
    std::int32_t low = 0, high = cut_parts;
    while (high - low > 1) {
      const std::int32_t middle = (low + high) / 2;
      (is_first(middle) ? low : high) = middle;
    }
    return low;
  }
  static Index3 position_of(Index3 p, Index3 direction, std::int32_t step) {
    return parts_per_point * p + parts_per_point / cut_parts * std::int64_t{step} * direction;
  }
};

/// Materials by thresholds of values, which are interpolated linearly along each axis: a position is in material n if
/// n thresholds, which rise, are at most its value.
class ValueField final : public MaterialField {
 public:
  /// `samples`: those around all positions that will be asked for. All arguments must stay.
  ValueField(const Samples<float>& samples, const SamplePlaces& places, std::span<const float> thresholds)
      : samples_(samples), places_(places), thresholds_(thresholds) {}

  /// A position depends on samples that are less than so far away, along each axis.
  static constexpr double reach = 1;

  void find_materials(Index3 first, std::span<Material> to) const override;
  Material at(Index3 position) const override { return material_of(value_at(position)); }
  std::int32_t find_cut(Index3 p, Index3 direction, Material a, Material b) const override;
  /// The interpolated value at a position.
  float value_at(Index3 position) const {
    return value(along(0, position.x), along(1, position.y), along(2, position.z));
  }

 private:
  // Between which samples a position lies, and how far it is from the first one.
  struct Along {
    std::int64_t first = 0;
    float part = 0;
  };
  Along along(int axis, std::int64_t position) const;
  float value(const Along& x, const Along& y, const Along& z) const;
  Material material_of(float value) const;

  Samples<float> samples_;
  SamplePlaces places_;
  std::span<const float> thresholds_;
};

/// Materials by labels: the sum of the weights of its samples is greatest for the material; of equal ones, the lowest
/// number wins. Without smoothing, weights are those of linear interpolation; with a radius of W samples, those of a
/// cubic B-spline with knots W samples apart.
class LabelField final : public MaterialField {
 public:
  /// As for ValueField. REQUIRES: the radius is 0, or from the smallest to the largest one.
  LabelField(const Samples<Material>& samples, const SamplePlaces& places, double radius)
      : samples_(samples), places_(places), radius_(radius) {}

  /// Below the smallest one, a position may be far from all samples.
  static constexpr double smallest_radius = 0.5, largest_radius = 4;
  static double reach(double radius) { return radius == 0 ? 1 : 2 * radius; }

  void find_materials(Index3 first, std::span<Material> to) const override;
  Material at(Index3 position) const override {
    return heaviest(weights(0, position.x), weights(1, position.y), weights(2, position.z));
  }
  std::int32_t find_cut(Index3 p, Index3 direction, Material a, Material b) const override;

 private:
  static constexpr std::size_t most_samples = 17;  // of a radius of 4: less than 8 to both sides
  // The samples along an axis on which a position depends.
  struct Weights {
    std::int64_t first = 0;
    std::uint32_t count = 0;
    std::array<std::int32_t, most_samples> of{};  // 2^16 or less, so that sums of products fit into 64 bits
  };
  Weights weights(int axis, std::int64_t position) const;
  Material heaviest(const Weights& x, const Weights& y, const Weights& z) const;
  // Calls visit(label, weight) for all samples of weight.
  template <class Visit>
  void for_each_sample(const Weights& x, const Weights& y, const Weights& z, Visit visit) const;

  Samples<Material> samples_;
  SamplePlaces places_;
  double radius_;
};

}  // namespace tagrid
