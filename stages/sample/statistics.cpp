#include "stages/sample/statistics.h"

#include <cmath>

namespace tagrid {

Achieved achieved_of(const Statistics& total) {
  Achieved a;
  a.max_error = total.max_error;
  const double squares = static_cast<double>(total.sum_squared_error) + total.sum_squared_real;
  // Samples that are not finite have no error that could be averaged.
  if (total.finite > 0) a.rmse = std::sqrt(squares / static_cast<double>(total.finite));
  const double peak = total.high - total.low;
  // Also undefined if no sample is finite, or all are equal.
  a.psnr = a.rmse > 0 && peak > 0 ? 20 * std::log10(peak / a.rmse) : NAN;
  if (!std::isfinite(a.psnr)) a.psnr = NAN;
  return a;
}

}  // namespace tagrid
