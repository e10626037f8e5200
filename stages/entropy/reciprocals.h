// Division by multiplication (T. Granlund and P. Montgomery, "Division by invariant integers using
// multiplication", 1994). A division would take longer than everything else that is done for an event.
#pragma once

#include <cstdint>
#include <vector>

namespace tagrid {

class Reciprocals {
 public:
  Reciprocals() : of_(65536) {
    for (std::uint64_t divisor = 1; divisor < of_.size(); ++divisor)
      of_[divisor] = ((std::uint64_t{1} << 63) + divisor - 1) / divisor;  // ceil(2^63 / divisor)
  }

  /// dividend / divisor, rounded down. REQUIRES: dividend < 2^47, 0 < divisor < 2^16. The result is exact:
  /// the reciprocal is too large by less than 1, so the product is too large by less than 2^47, which is less
  /// than 2^63 / divisor.
  std::uint64_t divide(std::uint64_t dividend, std::uint64_t divisor) const {
    __extension__ using Wide = unsigned __int128;
    return static_cast<std::uint64_t>(Wide{dividend} * 2 * of_[divisor] >> 64);
  }

 private:
  std::vector<std::uint64_t> of_;
};

}  // namespace tagrid
