#include "stages/values/points/field.h"

#include <cmath>
#include <limits>

#include "stages/grid/lattice.h"
#include "stages/values/points/interpolation.h"

namespace tagrid {

template <class T>
std::vector<FieldNumber<T>> interpolate_points(std::span<const T> points, const LatticeBits& active,
                                               int cube_size) {
  using Number = FieldNumber<T>;
  std::vector<Number> field(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if constexpr (std::is_integral_v<T>)
      field[i] = to_fixed<Number>(points[i], cube_size);
    else
      field[i] = points[i];
  }
  interpolate<Number>(active, active.box(), cube_size, field);
  return field;
}

template <class T>
std::vector<T> rounded_field(std::span<const FieldNumber<T>> field, std::span<const T> points,
                             const LatticeBits& active, int cube_size) {
  std::vector<T> samples(field.size());
  if constexpr (std::is_integral_v<T>) {
    round_to_samples<T, FieldNumber<T>>(field, cube_size, samples);
  } else {
    for (std::size_t i = 0; i < field.size(); ++i)
      samples[i] = std::isnan(field[i]) ? std::numeric_limits<T>::quiet_NaN() : static_cast<T>(field[i]);
    for_each_set(active, [&](Index3, std::size_t i) { samples[i] = points[i]; });
  }
  return samples;
}

LatticeBits prefix_of(const LatticeBits& active, int cube_size, int level) {
  LatticeBits prefix(active.box());
  for_each_set(active, [&](Index3 p, std::size_t) {
    if (classify(p, cube_size).level <= level) prefix.set(p);
  });
  return prefix;
}

#define TAGRID_INSTANTIATE(T)                                                                           \
  template std::vector<FieldNumber<T>> interpolate_points(std::span<const T>, const LatticeBits&, int); \
  template std::vector<T> rounded_field(std::span<const FieldNumber<T>>, std::span<const T>,            \
                                        const LatticeBits&, int);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
