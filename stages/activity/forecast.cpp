#include "stages/activity/forecast.h"

#include <algorithm>
#include <vector>

#include "stages/criterion/curvature.h"
#include "stages/criterion/marking.h"
#include "stages/criterion/subdivide.h"
#include "stages/sample/sample_type.h"
#include "stages/sample/samples.h"

namespace tagrid {
namespace {

// The samples of `box`; points outside `owned` get the value of the nearest point in it.
template <class T>
std::vector<T> extended(std::span<const T> samples, const Box& owned, const Box& box) {
  std::vector<T> values;
  values.reserve(static_cast<std::size_t>(box.count()));
  const std::int64_t width = owned.size().x;
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y) {
      const auto row = samples.begin() + owned.offset(owned.nearest({owned.low.x, y, z}));
      values.insert(values.end(), static_cast<std::size_t>(owned.low.x - box.low.x), row[0]);
      values.insert(values.end(), row, row + width);
      values.insert(values.end(), static_cast<std::size_t>(box.high.x - owned.high.x), row[width - 1]);
    }
  return values;
}

}  // namespace

std::uint64_t working_bytes_of_forecast(SampleType type, Index3 size, int cube_size) {
  const Index3 read = Box::of_size(size).grown(CurvatureField::halo).size();
  const auto count = [](const Index3& n) { return static_cast<std::uint64_t>(n.x * n.y * n.z); };
  const std::uint64_t heights = is_wide_type(type) ? count(size) * sizeof(double) : 0,
                      values = count(read) * (is_wide_type(type) ? sizeof(double) : size_of(type)),
                      forecast = working_bytes_of_curvature(size, cube_size) + Forecast::working_bytes(size);
  return std::max(values + std::max(heights, forecast),
                  Forecast::working_bytes(size) + working_bytes_of_closure(size));
}

template <class T>
Forecast forecast_activity(std::span<const T> samples, const CodingParameters& parameters, Index3 brick) {
  const Box closed = parameters.bricks().closed_box(brick), owned = parameters.bricks().owned_box(brick),
            read = closed.grown(CurvatureField::halo);
  std::array<LatticeBits, Forecast::levels> sets;
  const auto grade = [&](const auto& values, double field_scale) {
    for (LatticeBits& set : sets) set = LatticeBits(closed);
    grade_curvature(values, closed, parameters.domain(),
                    {parameters.accuracy, field_scale, parameters.max_level}, sets);
  };
  if constexpr (is_wide<T>) {
    const std::vector<double> heights =
        extended<double>(heights_of<T>(samples, parameters.range_low, parameters.field_scale), owned, read);
    grade(Samples<double>{read, heights.data()}, 1);
  } else if (!all_equal(samples)) {
    const std::vector<T> values = extended<T>(samples, owned, read);
    grade(Samples<T>{read, values.data()}, parameters.field_scale);
  } else {
    for (LatticeBits& set : sets) set = LatticeBits(closed);
  }
  close_under_parents(sets, parameters.cube_size);
  return Forecast(std::move(sets));
}

#define TAGRID_INSTANTIATE(T)                                                                         \
  template Forecast forecast_activity(std::span<const T> samples, const CodingParameters& parameters, \
                                      Index3 brick);
TAGRID_FOR_EACH_TYPE(TAGRID_INSTANTIATE)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
