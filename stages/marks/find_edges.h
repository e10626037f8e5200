// Finds the base edges that have to be measured, a vector of edges at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stages/marks/base_edges.h"
#include "stages/marks/criterion.h"
#include "stages/marks/curvature.h"
#include "stages/marks/edge_tests.h"

namespace tagrid {

/// Edges that were found, each with the number of its point.
struct FoundEdges {
  EdgeBatch edges{};
  std::array<std::uint32_t, EdgeBatch::capacity + EdgeBatch::padding> points{};
  std::size_t count = 0;

  bool has_room() const { return count + EdgeBatch::padding <= EdgeBatch::capacity; }
};

/// The numbers of points: point (i, j) has the number `first` + 2 unit i + `row` j.
struct PointNumbers {
  std::uint32_t first, row;
};

/// Where a search is, or has ended.
struct EdgePlace {
  std::int64_t column = 0, row = 0;
};

/// Appends the edges that the test finds to `found`, row by row from `from` on, as long as there is room. Returns true
/// if that was all; otherwise it goes on at `from`. rise_scale: voxels per unit of the field's value component.
/// REQUIRES: the points of the field are two units apart.
bool find_edges(const CurvatureField& field, const PointsOfSlice& points, float rise_scale,
                const BentTest& test, PointNumbers numbers, EdgePlace& from, FoundEdges& found);
bool find_edges(const CurvatureField& field, const PointsOfSlice& points, float rise_scale,
                const VarianceTest& test, PointNumbers numbers, EdgePlace& from, FoundEdges& found);

}  // namespace tagrid
