// Grey levels of values.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace tagrid {

/// Values up to `low` are black, and values from `high` on are white. REQUIRES: finite; low < high.
struct GreyWindow {
  double low = 0, high = 1;

  /// The gray level of a value; nothing for NaN. Halves are rounded up.
  std::optional<std::uint8_t> grey(double value) const {
    if (value != value) return std::nullopt;
    if (value <= low) return std::uint8_t{0};
    if (value >= high) return std::uint8_t{255};
    // Halved, as the difference of two doubles can be infinite.
    return static_cast<std::uint8_t>((value / 2 - low / 2) / (high / 2 - low / 2) * 255 + 0.5);
  }
};

/// The window from the value below which 0.5 percent of the values lie to that above which 0.5 percent lie.
/// Values that are not finite do not count; nor does a value that more than half of all others equal, which
/// usually is padding, unless fewer than eight different values are left: a mask or labels. If nothing is
/// left, or all is equal, the window begins there and has a width of 1, or of the next larger double. Changes
/// the order of `values`.
GreyWindow window_of(std::vector<double>& values);

}  // namespace tagrid
