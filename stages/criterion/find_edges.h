// Finds the base edges that have to be measured, a vector of edges at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stages/criterion/base_edges.h"
#include "stages/criterion/criterion.h"
#include "stages/criterion/curvature.h"
#include "stages/criterion/edge_tests.h"
#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// Edges that were found, each with the number of its point.
struct FoundEdges {
  EdgeBatch edges{};
  std::array<std::uint32_t, EdgeBatch::capacity + EdgeBatch::padding> points{};
  std::size_t count = 0;
};

/// The numbers of points: point (i, j) has the number `first` + 2 unit i + `row` j.
struct PointNumbers {
  std::uint32_t first, row;
};
/// The numbers of bits, counted from the first bit of bits.words(). REQUIRES: there are fewer than 2^32.
inline PointNumbers numbers_of(const PointsOfSlice& points, const LatticeBits& bits) {
  const std::size_t row = 2 * static_cast<std::size_t>(points.unit) * 64 * bits.words_per_row();
  return {static_cast<std::uint32_t>(bits.bit_of({points.x0, points.y0, points.z})),
          static_cast<std::uint32_t>(row)};
}

/// Where a search is, or has ended.
struct EdgePlace {
  std::int64_t column = 0, row = 0;
};

/// The base edges of some points of a slice.
struct EdgesOfSlice {
  const CurvatureField& field;  ///< its points are two units apart
  float rise_scale;             ///< voxels per unit of the field's value component
  PointsOfSlice points;
  PointNumbers numbers;
};

/// Appends the edges that the test finds to `found`, row by row from `from` on, as long as there is room.
/// Returns true if that was all; otherwise it goes on at `from`.
bool find_edges(const EdgesOfSlice& edges, const BentTest& test, EdgePlace& from, FoundEdges& found);
bool find_edges(const EdgesOfSlice& edges, const VarianceTest& test, EdgePlace& from, FoundEdges& found);

}  // namespace tagrid
