#include "stages/criterion/tile.h"

#include <algorithm>
#include <span>
#include <vector>

#include "stages/criterion/curvature.h"
#include "stages/criterion/heights.h"
#include "stages/criterion/marking.h"
#include "stages/criterion/mesh_criterion.h"

namespace tagrid {
namespace {

// Where all is air, or was cut away, there is nothing to mark. Of wide samples some are no numbers.
template <class T>
bool nothing_to_mark(const Samples<T>& samples, const CodingParameters& parameters) {
  if constexpr (is_wide<T>) return false;
  const bool border_is_marked = parameters.bounds_interpolation() && mesh_bounds(parameters).border < 0;
  return !border_is_marked &&
         all_equal(std::span<const T>(samples.data, static_cast<std::size_t>(samples.box.count())));
}

template <class T>
LatticeBits mark_samples(const Samples<T>& samples, const Box& cubes, const Box& marked,
                         const CodingParameters& parameters) {
  if (nothing_to_mark(samples, parameters)) return {};
  LatticeBits marks(marked);
  // Wide samples are made into heights, narrow ones are multiplied by the field scale late.
  if constexpr (is_wide<T>) {
    const auto count = static_cast<std::size_t>(samples.box.count());
    const std::vector<double> heights =
        heights_of<T>(std::span(samples.data, count), parameters.range_low, parameters.field_scale);
    mark_curvature(Samples<double>{samples.box, heights.data()}, cubes, parameters.domain(),
                   {parameters.accuracy, 1, parameters.max_level}, marks);
  } else {
    mark_curvature(samples, cubes, parameters.domain(),
                   {parameters.accuracy, parameters.field_scale, parameters.max_level}, marks);
  }
  if (parameters.bounds_interpolation())
    mark_mesh_error(samples, parameters.domain(), mesh_bounds(parameters), marks);
  return marks;
}

}  // namespace

int mark_halo(const CodingParameters& parameters) {
  return parameters.bounds_interpolation()
             ? std::max(CurvatureField::halo, mesh_criterion_halo(parameters.cube_size))
             : CurvatureField::halo;
}

LatticeBits mark_tile(const BrickSamples& samples, const Box& cubes, const Box& marked,
                      const CodingParameters& parameters) {
  return with_sample_type(parameters.type, [&](auto type) {
    return mark_samples(samples.as<decltype(type)>(), cubes, marked, parameters);
  });
}

std::uint64_t working_bytes_of_marking(const CodingParameters& parameters, Index3 cubes) {
  const Index3 read = Box::of_size(cubes).grown(mark_halo(parameters)).size();
  const std::uint64_t heights = is_wide_type(parameters.type)
                                    ? static_cast<std::uint64_t>(read.x * read.y * read.z) * sizeof(double)
                                    : 0;
  const std::uint64_t mesh = parameters.bounds_interpolation() ? working_bytes_of_mesh_criterion(cubes) : 0;
  return LatticeBits::working_bytes(cubes) +
         std::max(working_bytes_of_curvature(cubes, parameters.cube_size) + heights, mesh);
}

}  // namespace tagrid
