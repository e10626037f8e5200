// The points of a box in raster order, for loops over all of them.
#pragma once

#include <cstdint>
#include <iterator>

#include "stages/grid/box.h"

namespace tagrid {

/// A range for `for (const auto [x, y, z] : points_of(box))`, x fastest; every step-th point along each axis.
class points_of {
 public:
  class Iterator {
   public:
    Iterator(const Box& box, Index3 at, std::int64_t step) : box_(box), at_(at), step_(step) {}
    Index3 operator*() const { return at_; }
    Iterator& operator++() {
      if ((at_.x += step_) <= box_.high.x) return *this;
      at_.x = box_.low.x;
      if ((at_.y += step_) <= box_.high.y) return *this;
      at_.y = box_.low.y;
      at_.z += step_;
      return *this;
    }
    bool operator!=(std::default_sentinel_t) const { return at_.z <= box_.high.z; }

   private:
    Box box_;
    Index3 at_;
    std::int64_t step_;
  };

  explicit points_of(const Box& box, std::int64_t step = 1) : box_(box), step_(step) {}
  explicit points_of(Index3 dims, std::int64_t step = 1) : points_of(Box::of_size(dims), step) {}
  Iterator begin() const { return {box_, box_.empty() ? Index3{0, 0, box_.high.z + 1} : box_.low, step_}; }
  std::default_sentinel_t end() const { return {}; }

 private:
  Box box_;
  std::int64_t step_;
};

}  // namespace tagrid
