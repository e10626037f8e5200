#include "stages/picture/grey_window.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace tagrid {
namespace {

// The value that more than half of the values equal, if there is one (R. Boyer and J. S. Moore, "MJRTY - a
// fast majority vote algorithm", 1991).
std::optional<double> majority(const std::vector<double>& values) {
  double candidate = 0;
  std::size_t votes = 0;
  for (const double value : values) {
    if (votes == 0) candidate = value;
    votes = value == candidate ? votes + 1 : votes - 1;
  }
  const auto count = static_cast<std::size_t>(std::count(values.begin(), values.end(), candidate));
  return 2 * count > values.size() ? std::optional(candidate) : std::nullopt;
}

// Whether there are fewer than eight different values.
bool are_few(const std::vector<double>& values) {
  std::vector<double> different;
  for (const double value : values) {
    if (std::ranges::find(different, value) != different.end()) continue;
    different.push_back(value);
    if (different.size() == 8) return false;
  }
  return true;
}

GreyWindow window_from(double low, double high) {
  if (low < high) return {low, high};
  // A large double has no other one within 1.
  if (const double next = std::max(low + 1, std::nextafter(low, std::numeric_limits<double>::max()));
      next > low)
    return {low, next};
  return {std::nextafter(low, 0.0), low};
}

}  // namespace

GreyWindow window_of(std::vector<double>& values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return {};
  const std::optional<double> padding = majority(values);
  if (padding) std::erase(values, *padding);
  if (values.empty()) return window_from(*padding, *padding);
  const auto nth = [&](std::size_t n) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(n);
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  const std::size_t outside = values.size() / 200;
  double low = nth(outside), high = nth(values.size() - 1 - outside);
  if (padding && are_few(values)) {
    low = std::min(low, *padding);
    high = std::max(high, *padding);
  }
  return window_from(low, high);
}

}  // namespace tagrid
