#include "stages/marks/variance.h"

#include <cstdint>

#include "stages/volume/vector_code.h"

namespace tagrid {

namespace variance {

// The weights are 720 times the integrals of the products of quadratic B-splines over the three segments, in
// terms of sums and differences of the two ends; sums and differences do not mix.
TAGRID_VECTOR_CODE
bool find_varied(const EdgeBatch& edges, std::size_t count, float inverse_length, float sixth, float limit,
                 EdgeBatch::Flags& found) {
  std::uint32_t any = 0;
  TAGRID_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float chord = edges.rise[i] * inverse_length;
    const float stretch = 1.0F + chord * chord;
    const float left = edges.slope_left[i] - chord, right = edges.slope_right[i] - chord;
    const float bend_left = sixth * edges.bend_left[i], bend_right = sixth * edges.bend_right[i];
    const float p = left - right, s = left + right, a = bend_right - bend_left, b = bend_left + bend_right;
    const float even = p * (91.0F * p + 106.0F * b) + 39.0F * (b * b);
    const float odd = s * (117.0F * s - 166.0F * a) + 73.0F * (a * a);
    const std::uint32_t above = even + odd > limit * (stretch * stretch) ? 1 : 0;
    found[i] = static_cast<std::uint8_t>(above);
    any |= above;
  }
  return any != 0;
}

}  // namespace variance

namespace {

// 1/sqrt(k) and sqrt(k)/3 for edges with k odd axes.
constexpr float inverse_sqrt[4] = {0, 1, 0.70710678F, 0.57735027F};
constexpr float sqrt_over_three[4] = {0, 1.0F / 3, 0.47140452F, 0.57735027F};

float sixth_of(const RowOfEdges& row) { return sqrt_over_three[row.odd] * static_cast<float>(row.unit); }

}  // namespace

VarianceTest::VarianceTest(int accuracy)
    : limit_(static_cast<float>(1184.5 / (static_cast<double>(accuracy) * static_cast<double>(accuracy)))) {}

// Let x be the largest |left| and |right| in find_varied(), and y the largest |bend_left| and |bend_right|: then
// p p + s s <= 4 x x and a a + b b <= 4 y y.
bool VarianceTest::none(const EdgeBounds& bounds, const RowOfEdges& row) const {
  const float x = bounds.slope + bounds.chord, y = sixth_of(row) * bounds.bend;
  return 4.0F * (117.0F * (x * x) + 166.0F * (x * y) + 73.0F * (y * y)) < 0.98F * limit_;
}

bool VarianceTest::find(const EdgeBatch& edges, std::size_t count, const RowOfEdges& row,
                        EdgeBatch::Flags& found) const {
  const float inverse_length = inverse_sqrt[row.odd] * (0.5F / static_cast<float>(row.unit));
  return variance::find_varied(edges, count, inverse_length, sixth_of(row), limit_, found);
}

}  // namespace tagrid
