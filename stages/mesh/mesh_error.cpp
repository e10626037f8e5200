#include "stages/mesh/mesh_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "stages/grid/lattice.h"
#include "stages/mesh/cut.h"
#include "stages/mesh/tetrahedra.h"
#include "stages/values/points/field.h"

namespace tagrid {
namespace {

// The error for integers.
template <class T>
class ExactMeasure {
 public:
  explicit ExactMeasure(int cube_size) : cube_size_(cube_size) {}

  void see_field(FieldNumber<T> field, T sample) {
    worst_fixed_ = std::max(worst_fixed_, std::abs(std::int64_t{field} - std::int64_t{sample} * cube_size_));
  }
  void see_piece(const std::array<T, 4>& values, const std::array<std::int64_t, 4>& weights, T sample) {
    std::int64_t difference = 0, whole = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      difference += weights[i] * (std::int64_t{values[i]} - std::int64_t{sample});
      whole += weights[i];
    }
    worst_ = std::max(worst_, static_cast<double>(std::abs(difference)) / static_cast<double>(whole));
  }
  double worst() const { return std::max(worst_, static_cast<double>(worst_fixed_) / cube_size_); }

 private:
  int cube_size_;
  std::int64_t worst_fixed_ = 0;
  double worst_ = 0;
};

// The error for floats.
template <class T>
class RealMeasure {
 public:
  explicit RealMeasure(int) {}

  void see_field(double field, T sample) {
    if (!std::isfinite(sample)) return;
    const double error = std::fabs(field - static_cast<double>(sample));
    // If the field is a NaN at a finite sample, the error is infinite.
    worst_ = std::isnan(error) ? std::numeric_limits<double>::infinity() : std::max(worst_, error);
  }
  void see_piece(const std::array<T, 4>& values, const std::array<std::int64_t, 4>& weights, T sample) {
    double whole = 0, field = 0, low = INFINITY, high = -INFINITY;
    for (const std::int64_t w : weights) whole += static_cast<double>(w);
    for (std::size_t i = 0; i < 4; ++i) {
      if (weights[i] == 0) continue;
      const auto value = static_cast<double>(values[i]);
      field += static_cast<double>(weights[i]) / whole * value;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    // Rounding must not lead out of the range of the vertices.
    if (low <= high) field = std::clamp(field, low, high);
    see_field(field, sample);
  }
  double worst() const { return worst_; }

 private:
  double worst_ = 0;
};

template <class T>
using Measure = std::conditional_t<std::is_integral_v<T>, ExactMeasure<T>, RealMeasure<T>>;

}  // namespace

template <class T>
double largest_mesh_error(std::span<const T> points, const LatticeBits& active, const Samples<T>& original,
                          const Box& measured, const Box& volume, int cube_size) {
  const Box& box = active.box();
  const auto field = interpolate_points<T>(points, active, cube_size);
  Measure<T> measure(cube_size);
  LatticeBits in_pieces;
  if (!volume.contains(box)) {
    in_pieces = LatticeBits(measured);
    const std::vector<T> rounded = rounded_field<T>(field, points, active, cube_size);
    for_each_leaf_tetrahedron(active, box, cube_size, max_level(cube_size), [&](const Tetrahedron& t) {
      if (!reaches_beyond(t.vertices, volume)) return;
      for (const auto& piece : cut_at(t.vertices, volume)) {
        std::array<T, 4> values;
        for (std::size_t i = 0; i < 4; ++i)
          values[i] = rounded[static_cast<std::size_t>(box.offset(piece[i]))];
        for_each_point_of(piece, measured, [&](Index3 p, const std::array<std::int64_t, 4>& weights) {
          measure.see_piece(values, weights, original.at(p));
          in_pieces.set(p);
        });
      }
    });
  }
  for (std::int64_t z = measured.low.z; z <= measured.high.z; ++z)
    for (std::int64_t y = measured.low.y; y <= measured.high.y; ++y) {
      const T* sample = original.data + original.box.offset({measured.low.x, y, z});
      const auto* number = field.data() + box.offset({measured.low.x, y, z});
      for (std::int64_t x = measured.low.x; x <= measured.high.x; ++x, ++sample, ++number)
        if (in_pieces.bytes() == 0 || !in_pieces.test({x, y, z})) measure.see_field(*number, *sample);
    }
  return measure.worst();
}

double measure_mesh(const BrickSamples& original, const std::vector<std::byte>& values,
                    const LatticeBits& active, const CodingParameters& parameters, Index3 brick) {
  const std::vector<std::byte>& of_mesh = values.empty() ? original.bytes : values;
  return with_sample_type(parameters.type, [&](auto type) {
    using T = decltype(type);
    const std::span<const T> points(reinterpret_cast<const T*>(of_mesh.data()), of_mesh.size() / sizeof(T));
    return largest_mesh_error<T>(points, active, original.as<T>(), parameters.bricks().owned_box(brick),
                                 parameters.domain().volume(), parameters.cube_size);
  });
}

std::uint64_t working_bytes_of_mesh_error(SampleType type, Index3 size) {
  return static_cast<std::uint64_t>(size.x * size.y * size.z) * (field_number_bytes(type) + size_of(type)) +
         LatticeBits::working_bytes(size);
}

#define TAGRID_INSTANTIATE(T)                                                                               \
  template double largest_mesh_error(std::span<const T>, const LatticeBits&, const Samples<T>&, const Box&, \
                                     const Box&, int);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
