#include "stages/marks/marking.h"

#include <span>
#include <utility>

#include "stages/marks/base_edges.h"
#include "stages/marks/edge_tests.h"
#include "stages/marks/find_edges.h"

namespace tagrid {
namespace {

// Only edges that the test finds are measured.
template <class Test>
class Marker {
 public:
  // A point is set in as many of the `sets` as its edge exceeds thresholds.
  Marker(const CurvatureField& field, const MarkingParameters& parameters,
         const CriterionParameters& constants, const Test& test, std::span<LatticeBits> sets)
      : field_(field),
        constants_(constants),
        test_(test),
        rise_scale_(static_cast<float>(parameters.field_scale) / CurvatureField::value_divisor),
        sets_(sets) {}

  void mark(const PointsOfSlice& points) {
    const PointNumbers numbers{static_cast<std::uint32_t>(sets_[0].bit_of({points.x0, points.y0, points.z})),
                               static_cast<std::uint32_t>(2 * points.unit) *
                                   static_cast<std::uint32_t>(64 * sets_[0].words_per_row())};
    for (EdgePlace place; !find_edges(field_, points, rise_scale_, test_, numbers, place, found_);) settle();
  }

  /// Decides about the edges that are left. Call it after the last row.
  void settle() {
    EdgeBatch::Flags exceeded;
    measure(found_.edges, found_.count, constants_, exceeded);
    for (std::size_t i = 0; i < found_.count; ++i)
      for (std::uint8_t level = 0; level < exceeded[i]; ++level) sets_[level].set(found_.points[i]);
    found_.count = 0;
  }

 private:
  const CurvatureField& field_;
  CriterionParameters constants_;
  Test test_;
  float rise_scale_;  ///< voxels per unit of the value component
  std::span<LatticeBits> sets_;
  FoundEdges found_;
};

template <class Test>
void mark(CurvatureField& field, const Domain& domain, const MarkingParameters& parameters,
          const CriterionParameters& constants, const Test& test, std::span<LatticeBits> sets) {
  const Box box = intersection(sets[0].box(), domain.volume());
  if (box.empty()) return;
  Marker<Test> marker(field, parameters, constants, test, sets);
  for (std::int64_t unit = 1; unit < domain.cube_size; unit *= 2) {
    if (unit > 1) keep_every_second_point(field);
    for_each_slice_of_points(box, domain.cube_size, parameters.max_level, unit,
                             [&](const PointsOfSlice& points) { marker.mark(points); });
  }
  marker.settle();
}

}  // namespace

void mark_curvature(CurvatureField field, const Domain& domain, const MarkingParameters& parameters,
                    LatticeBits& marks) {
  const CriterionParameters constants(parameters.accuracy);
  mark(field, domain, parameters, constants, BentTest{constants}, std::span(&marks, 1));
}

void grade_curvature(CurvatureField field, const Domain& domain, const MarkingParameters& parameters,
                     std::array<LatticeBits, CriterionParameters::excesses>& sets) {
  mark(field, domain, parameters, CriterionParameters(parameters.accuracy, {0.6, 1, 1.6}),
       VarianceTest(parameters.accuracy), sets);
}

}  // namespace tagrid
