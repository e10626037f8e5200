// Lengths that are easy to read.
#pragma once

namespace tagrid {

/// The longest of 1, 2, 5, 10, 20, 50 ..., and of 0.5, 0.2, 0.1 ..., that is at most `length`. REQUIRES: 1e-300 <= length <=
/// 1e300.
constexpr double round_length(double length) {
  double power = 1;
  while (power * 10 <= length) power *= 10;
  // Divided from 1 down, which gives the doubles that are nearest to 0.1, 0.01 ...
  double divisor = 1;
  while (power / divisor > length) divisor *= 10;
  const double unit = power / divisor;
  return 5 * unit <= length ? 5 * unit : 2 * unit <= length ? 2 * unit : unit;
}

}  // namespace tagrid
