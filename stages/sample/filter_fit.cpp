#include "stages/sample/filter_fit.h"

#include <algorithm>
#include <cmath>

namespace tagrid {

void FilterSums::add(const FilterSums& other) {
  for (std::size_t a = 0; a < filter_weights; ++a) {
    wanted[a] += other.wanted[a];
    for (std::size_t b = a; b < filter_weights; ++b) products[a][b] += other.products[a][b];
  }
}

FilterWeights fitted_weights(const FilterSums& sums) {
  constexpr std::size_t n = filter_weights;
  std::array<std::array<double, n + 1>, n> rows;
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = 0; b < n; ++b)
      rows[a][b] = static_cast<double>(sums.products[std::min(a, b)][std::max(a, b)]);
    // So little that it costs nothing, and the matrix is far from singular.
    rows[a][a] = rows[a][a] * (1 + 1e-5) + 1;
    rows[a][n] = static_cast<double>(sums.wanted[a]);
  }
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b) {
      const double factor = rows[b][a] / rows[a][a];
      for (std::size_t i = a; i <= n; ++i) rows[b][i] -= factor * rows[a][i];
    }
  FilterWeights weights;
  for (std::size_t a = n; a-- > 0;) {
    double rest = rows[a][n];
    for (std::size_t b = a + 1; b < n; ++b) rest -= rows[a][b] * rows[b][n];
    rows[a][n] = rest / rows[a][a];
    weights[a] = static_cast<std::int16_t>(std::clamp(
        std::floor(rows[a][n] * 1024 + 0.5), -double{most_filter_weight}, double{most_filter_weight}));
  }
  return weights;
}

}  // namespace tagrid
