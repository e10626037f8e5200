#include "stages/criterion/marking.h"

#include <algorithm>
#include <bit>
#include <span>
#include <vector>

#include "stages/criterion/base_edges.h"
#include "stages/criterion/curvature.h"
#include "stages/criterion/find_edges.h"
#include "stages/criterion/mesh_criterion.h"
#include "stages/sample/sample_type.h"

namespace tagrid {
namespace {

// Base edges end in two slices of points, so two are kept for each unit.
constexpr std::int64_t kept_slices = 2;

// Only edges that the test finds are measured.
template <class Test>
class Marker {
 public:
  // A point is set in as many of the `sets` as its edge exceeds thresholds.
  Marker(const Box& cubes, const Domain& domain, const MarkingParameters& parameters,
         const CriterionParameters& constants, const Test& test, std::span<LatticeBits> sets)
      : parameters_(parameters),
        constants_(constants),
        test_(test),
        rise_scale_(static_cast<float>(parameters.field_scale) / CurvatureField::value_divisor),
        cube_size_(domain.cube_size),
        box_(intersection(sets[0].box(), domain.volume())),
        sets_(sets) {
    for (std::int64_t unit = 1; unit < cube_size_; unit *= 2)
      fields_.emplace_back(cubes, 2 * unit, kept_slices);
  }

  template <class T>
  void mark(const Samples<T>& samples) {
    if (box_.empty()) return;
    const Box& cubes = fields_[0].box;
    for (std::int64_t z = cubes.low.z; z <= cubes.high.z; z += 2) {
      evaluate_curvature(samples, z, parameters_.field_scale, fields_[0]);
      mark_up_to(z, 0);
    }
    settle();
  }

 private:
  // Slice z of the field with this index is there: marks the points in it, and between it and the one before.
  void mark_up_to(std::int64_t z, std::size_t index) {
    const CurvatureField& field = fields_[index];
    const std::int64_t unit = field.distance / 2;
    for (const std::int64_t at : {z - unit, z})
      for_each_class_of_points(box_, cube_size_, parameters_.max_level, unit, at,
                               [&](const PointsOfSlice& points) { mark_points(field, points); });
    if (index + 1 == fields_.size() || z % fields_[index + 1].distance != 0) return;
    thin_out(field, z, fields_[index + 1]);
    mark_up_to(z, index + 1);
  }

  void mark_points(const CurvatureField& field, const PointsOfSlice& points) {
    const EdgesOfSlice edges{field, rise_scale_, points, numbers_of(points, sets_[0])};
    for (EdgePlace place; !find_edges(edges, test_, place, found_);) settle();
  }

  // Decides about the edges that were found.
  void settle() {
    EdgeBatch::Flags exceeded;
    measure(found_.edges, found_.count, constants_, exceeded);
    // Without a branch for each edge: it could not be predicted.
    for (std::size_t level = 0; level < sets_.size(); ++level) {
      const std::span<std::uint64_t> words = sets_[level].words();
      for (std::size_t i = 0; i < found_.count; ++i)
        words[found_.points[i] / 64] |= std::uint64_t{exceeded[i] > level} << found_.points[i] % 64;
    }
    found_.count = 0;
  }

  MarkingParameters parameters_;
  CriterionParameters constants_;
  Test test_;
  float rise_scale_;  ///< voxels per unit of the value component
  int cube_size_;
  Box box_;  ///< of the points that are marked
  std::span<LatticeBits> sets_;
  std::vector<CurvatureField> fields_;  ///< one for each unit
  FoundEdges found_;
};

}  // namespace

template <class T>
void mark_curvature(const Samples<T>& samples, const Box& cubes, const Domain& domain,
                    const MarkingParameters& parameters, LatticeBits& marks) {
  const CriterionParameters constants(parameters.accuracy);
  Marker(cubes, domain, parameters, constants, BentTest(constants), std::span(&marks, 1)).mark(samples);
}

template <class T>
void grade_curvature(const Samples<T>& samples, const Box& cubes, const Domain& domain,
                     const MarkingParameters& parameters,
                     std::array<LatticeBits, CriterionParameters::excesses>& sets) {
  const CriterionParameters constants(parameters.accuracy, {0.6, 1, 1.6});
  Marker(cubes, domain, parameters, constants, VarianceTest(parameters.accuracy),
         std::span<LatticeBits>(sets))
      .mark(samples);
}

std::uint64_t working_bytes_of_curvature(Index3 cubes, int cube_size) {
  std::uint64_t bytes = working_bytes_of_evaluating(cubes.x), fields = 0;
  for (std::int64_t unit = 1; unit < cube_size; unit *= 2, ++fields)
    bytes += CurvatureField::working_bytes(cubes, 2 * unit, kept_slices);
  return bytes + 2 * std::bit_ceil(fields) * sizeof(CurvatureField);
}

#define TAGRID_INSTANTIATE(T)                                                                           \
  template void mark_curvature(const Samples<T>&, const Box&, const Domain&, const MarkingParameters&,  \
                               LatticeBits&);                                                           \
  template void grade_curvature(const Samples<T>&, const Box&, const Domain&, const MarkingParameters&, \
                                std::array<LatticeBits, CriterionParameters::excesses>&);
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
TAGRID_INSTANTIATE(double)
#undef TAGRID_INSTANTIATE

namespace {

// Where all is air, or was cut away, there is nothing to mark. Wide samples may be NaN.
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
  // Wide samples become heights; narrow ones are multiplied by the field scale later.
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
