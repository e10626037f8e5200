// Slices of a volume in memory, boxes of samples copied from them, and the range of samples.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "stages/grid/box.h"
#include "stages/sample/sample_type.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// Samples of one z: complete rows, x fastest. All readers share them; the last reader frees them.
using SliceSamples = std::shared_ptr<const std::byte[]>;

/// Slices first, first + 1, ..., each with the rows from first_row on: points of the lattice, not numbers of
/// samples. Copies share the slices.
struct SliceRange {
  std::int64_t first = 0, first_row = 0;
  std::shared_ptr<const std::vector<SliceSamples>> slices;
};

/// The sample nearest to a point, of a volume of samples of `size` bytes. REQUIRES: `range` holds it.
inline const std::byte* sample_at(const SliceRange& range, const Box& volume, std::size_t size,
                                  Index3 point) {
  const Index3 p = volume.nearest(point);
  assert(p.z >= range.first && p.z - range.first < static_cast<std::int64_t>(range.slices->size()));
  assert(p.y >= range.first_row);
  return (*range.slices)[static_cast<std::size_t>(p.z - range.first)].get() +
         static_cast<std::size_t>((p.y - range.first_row) * volume.size().x + p.x - volume.low.x) * size;
}

/// The samples of `box` from a volume of samples of this type. A point outside the volume takes the value of
/// the nearest sample. REQUIRES: `range` holds the rows of slices nearest to the box.
inline BrickSamples gather(const SliceRange& range, const Box& volume, SampleType type, const Box& box) {
  const std::size_t size = size_of(type);
  BrickSamples samples{box, std::vector<std::byte>(static_cast<std::size_t>(box.count()) * size)};
  std::byte* out = samples.bytes.data();
  const auto copy = [&](const std::byte* from, std::int64_t count) {
    const std::size_t bytes = static_cast<std::size_t>(count) * size;
    std::memcpy(out, from, bytes);
    out += bytes;
  };
  const std::int64_t low = std::clamp(box.low.x, volume.low.x, volume.high.x),
                     high = std::clamp(box.high.x, volume.low.x, volume.high.x);
  const std::int64_t before = std::clamp<std::int64_t>(volume.low.x - box.low.x, 0, box.size().x - 1);
  const std::int64_t after = box.size().x - before - (high - low + 1);
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y) {
      const std::byte *first = sample_at(range, volume, size, {low, y, z}),
                      *last = first + static_cast<std::size_t>(high - low) * size;
      for (std::int64_t x = 0; x < before; ++x) copy(first, 1);
      copy(first, high - low + 1);
      for (std::int64_t x = 0; x < after; ++x) copy(last, 1);
    }
  return samples;
}

/// The slices that have been read and may still be needed.
class SliceWindow {
 public:
  /// Begins with slice `first`; all slices have the rows from `first_row` on.
  SliceWindow(std::int64_t first, std::int64_t first_row) : first_(first), first_row_(first_row) {}

  void add(SliceSamples slice) { slices_.push_back(std::move(slice)); }
  /// One more than the z of the last slice that was added.
  std::int64_t end() const { return first_ + static_cast<std::int64_t>(slices_.size()); }
  /// REQUIRES: low .. high are in the window.
  SliceRange range(std::int64_t low, std::int64_t high) const {
    assert(low >= first_ && high < end());
    return {low, first_row_,
            std::make_shared<const std::vector<SliceSamples>>(slices_.begin() + (low - first_),
                                                              slices_.begin() + (high - first_ + 1))};
  }
  void release_below(std::int64_t z) {
    for (; first_ < z && !slices_.empty(); ++first_) slices_.pop_front();
  }

 private:
  std::int64_t first_ = 0, first_row_ = 0;
  std::deque<SliceSamples> slices_;
};

struct ValueRange {
  double low = INFINITY, high = -INFINITY;
  std::uint64_t finite = 0;  ///< how many samples are finite

  void add(const ValueRange& other) {
    low = std::min(low, other.low);
    high = std::max(high, other.high);
    finite += other.finite;
  }
};

inline ValueRange value_range(std::span<const std::byte> samples, SampleType type) {
  return with_sample_type(type, [&](auto sample) {
    using T = decltype(sample);
    const std::span all(reinterpret_cast<const T*>(samples.data()), samples.size() / sizeof(T));
    ValueRange range;
    if constexpr (std::is_integral_v<T>) {
      if (all.empty()) return range;
      const auto [low, high] = std::minmax_element(all.begin(), all.end());
      range = {static_cast<double>(*low), static_cast<double>(*high), all.size()};
    } else {
      for (const T v : all) {
        if (!std::isfinite(v)) continue;
        ++range.finite;
        range.low = std::min(range.low, static_cast<double>(v));
        range.high = std::max(range.high, static_cast<double>(v));
      }
    }
    return range;
  });
}

}  // namespace tagrid
