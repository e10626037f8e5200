#include "stages/values/prediction/products.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/values/prediction/products.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "stages/sample/instruction_sets.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR
void add_products(const std::int16_t (*numbers)[32], int rows, std::int32_t (*parts)[16]) {
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j <= i; ++j, ++parts)
      for (int x = 0; x < 32; ++x) (*parts)[x / 2] += numbers[i][x] * numbers[j][x];
}
#else
void add_products(const std::int16_t (*numbers)[32], int rows, std::int32_t (*parts)[16]) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::FixedTag<std::int16_t, HWY_MAX_BYTES / 2> d;
  const hn::Repartition<std::int32_t, decltype(d)> d32;
  constexpr std::size_t width = HWY_MAX_BYTES / 2;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j <= i; ++j, ++parts)
      for (std::size_t x = 0; x < 32; x += width) {
        auto more = hn::Zero(d32);
        const auto sum =
            hn::ReorderWidenMulAccumulate(d32, hn::LoadU(d, numbers[i] + x), hn::LoadU(d, numbers[j] + x),
                                          hn::LoadU(d32, *parts + x / 2), more);
        hn::StoreU(hn::Add(sum, more), d32, *parts + x / 2);
      }
}
#endif

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tagrid {

ProductSums::ProductSums(int rows, std::int64_t magnitude)
    : add_products_(TAGRID_BEST_VERSION(add_products)),
      rows_(rows),
      // A chunk adds two products to each part.
      limit_(std::numeric_limits<std::int32_t>::max() /
             (2 * std::max<std::int64_t>(1, magnitude * magnitude))) {
  assert(rows <= most_rows && magnitude <= magnitude_limit);
}

void ProductSums::add(const std::int16_t (*numbers)[chunk]) {
  if (pending_ == limit_) carry();
  add_products_(numbers, rows_, reinterpret_cast<std::int32_t(*)[lanes]>(parts_.data()));
  ++pending_;
}

void ProductSums::carry() {
  for (std::size_t p = 0; p < parts_.size(); ++p)
    for (std::int32_t& part : parts_[p]) {
      totals_[p] += part;
      part = 0;
    }
  pending_ = 0;
}

const std::int64_t* ProductSums::totals() {
  carry();
  return totals_.data();
}

}  // namespace tagrid
#endif
