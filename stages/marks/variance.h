// A cheap form of the accuracy criterion, which decides which edges the forecast of the activity measures. It is
// part of the format (section 6.6 of docs/format.md): no operation may be reordered.
//
// If the step of an end is a third of the chord, its largest value, the spline of criterion.h is the graph of
// a function. The slope of this function is a quadratic spline of the slopes of the five legs. For small
// slopes, R / C - 1 is half the variance of that slope, a quadratic form of four numbers, without a square
// root.
#pragma once

#include <cstddef>

#include "stages/marks/base_edges.h"
#include "stages/marks/criterion.h"

namespace tagrid {

/// Finds the edges of a row whose form is more than half of what the criterion allows.
class VarianceTest {
 public:
  /// `accuracy`: m of the criterion.
  explicit VarianceTest(int accuracy);

  /// True if find() would find none among edges within these bounds.
  bool none(const EdgeBounds& bounds, const RowOfEdges& row) const;
  /// found[i] is 1 if edge i of `count` edges of a row is found, otherwise 0; returns whether any is.
  bool find(const EdgeBatch& edges, std::size_t count, const RowOfEdges& row, EdgeBatch::Flags& found) const;

 private:
  float limit_;
};

}  // namespace tagrid
