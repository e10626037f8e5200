#include "stages/overview/block_sums.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace tagrid {
namespace {

/// The type of the sums of samples of type T, as stored for blocks of 4 or of more samples.
template <class T, bool first>
using Sum = std::conditional_t<std::is_floating_point_v<T>, double,
                               std::conditional_t<first && sizeof(T) <= 2, std::int32_t, std::int64_t>>;

/// Calls f(T{}, Sum{}) for a layout.
template <class F>
void with_types(const SumsLayout& layout, F f) {
  with_sample_type(layout.type, [&](auto sample) {
    using T = decltype(sample);
    if (layout.factor == block_edge)
      f(T{}, Sum<T, true>{}, std::true_type{});
    else
      f(T{}, Sum<T, false>{}, std::false_type{});
  });
}

template <class T>
void add_row(const T* row, std::int64_t width, auto* sums, std::uint32_t* counts) {
  for (std::int64_t x = 0; x < width; ++x) {
    if constexpr (std::is_floating_point_v<T>) {
      const bool finite = std::isfinite(row[x]);
      sums[x] += finite ? static_cast<double>(row[x]) : 0.0;
      counts[x] += finite;
    } else {
      sums[x] += row[x];
    }
  }
}

/// Adds up to 4 neighbours of each group.
template <class T>
void add_columns(const T* columns, std::int64_t width, T* sums) {
  for (std::int64_t x = 0; x < width; x += block_edge) {
    T sum = columns[x];
    for (std::int64_t i = x + 1; i < std::min(x + block_edge, width); ++i) sum += columns[i];
    sums[x / block_edge] = sum;
  }
}

/// Samples of the volume in a block, along an axis.
std::int64_t samples_in(std::int64_t block, std::int64_t factor, std::int64_t samples) {
  return std::min(factor, samples - block * factor);
}

template <class T>
T mean_of(std::int64_t sum, std::int64_t count) {
  std::int64_t mean = sum / count, rest = sum % count;
  if (rest < 0) {
    --mean;
    rest += count;
  }
  return static_cast<T>(mean + (2 * rest >= count));
}

template <class T>
T mean_of(double sum, std::uint32_t count) {
  if (count == 0 || !std::isfinite(sum)) return std::numeric_limits<T>::quiet_NaN();
  return static_cast<T>(sum / count);
}

}  // namespace

SumsLayout layout_of_sums(const Index3& dims, SampleType type, std::int64_t factor) {
  SumsLayout layout{type, factor, dims};
  for (int axis = 0; axis < 3; ++axis) layout.blocks[axis] = (dims[axis] - 1) / factor + 1;
  return layout;
}

SlabSums::SlabSums(const SumsLayout& layout, std::int64_t width, std::int64_t rows)
    : layout_(layout), width_(width), rows_(rows) {
  const auto columns = static_cast<std::size_t>(width * blocks_along(rows));
  sums_.resize(columns * layout.sum_bytes());
  if (layout.count_bytes() > 0) counts_.resize(columns);
}

std::uint64_t SlabSums::memory(const SumsLayout& layout, std::int64_t width, std::int64_t rows) {
  const auto columns = static_cast<std::uint64_t>(width * blocks_along(rows));
  return columns * (layout.sum_bytes() + layout.count_bytes()) +
         static_cast<std::uint64_t>(blocks_along(rows)) * layout.row_bytes();
}

void SlabSums::add_rows(const std::byte* slice, std::int64_t y_low, std::int64_t y_end) {
  const auto width = static_cast<std::size_t>(width_);
  with_types(layout_, [&]<class T, class S, class First>(T, S, First) {
    auto* const sums = reinterpret_cast<S*>(sums_.data());
    SumsLayout before = layout_;
    before.factor /= block_edge;
    const std::size_t size = First::value ? sizeof(T) : before.sum_bytes(),
                      row_bytes = width * (First::value ? size : size + layout_.count_bytes());
    slice += static_cast<std::size_t>(y_low) * row_bytes;
    for (std::int64_t y = y_low; y < y_end; ++y, slice += row_bytes) {
      const auto first = static_cast<std::size_t>(y / block_edge) * width;
      std::uint32_t* const counts = counts_.empty() ? nullptr : counts_.data() + first;
      if constexpr (First::value) {
        add_row(reinterpret_cast<const T*>(slice), width_, sums + first, counts);
      } else {
        // Rows of stored sums may lie at any address.
        for (std::size_t x = 0; x < width; ++x) {
          if constexpr (std::is_floating_point_v<T>) {
            double sum;
            std::uint32_t count;
            std::memcpy(&sum, slice + x * size, size);
            std::memcpy(&count, slice + width * size + x * 4, 4);
            sums[first + x] += sum;
            counts[x] += count;
          } else if (size == 4) {
            std::int32_t sum;
            std::memcpy(&sum, slice + x * size, size);
            sums[first + x] += sum;
          } else {
            std::int64_t sum;
            std::memcpy(&sum, slice + x * size, size);
            sums[first + x] += sum;
          }
        }
      }
    }
  });
}

void SlabSums::take(std::vector<std::byte>& rows) {
  rows.resize(static_cast<std::size_t>(blocks_along(rows_)) * layout_.row_bytes());
  std::byte* out = rows.data();
  const auto blocks = static_cast<std::size_t>(layout_.blocks.x), width = static_cast<std::size_t>(width_);
  with_types(layout_, [&]<class T, class S, class First>(T, S, First) {
    const auto* columns = reinterpret_cast<const S*>(sums_.data());
    std::vector<S> sums(blocks);
    std::vector<std::uint32_t> counts(counts_.empty() ? 0 : blocks);
    for (std::int64_t y = 0; y < blocks_along(rows_); ++y, columns += width) {
      add_columns(columns, width_, sums.data());
      std::memcpy(out, sums.data(), blocks * sizeof(S));
      out += blocks * sizeof(S);
      if (counts.empty()) continue;
      add_columns(counts_.data() + static_cast<std::size_t>(y) * width, width_, counts.data());
      std::memcpy(out, counts.data(), blocks * 4);
      out += blocks * 4;
    }
  });
  std::ranges::fill(sums_, std::byte{0});
  std::ranges::fill(counts_, 0U);
}

void means_of_row(const SumsLayout& layout, const Index3& dims, std::int64_t y, std::int64_t z,
                  std::span<const std::byte> row, std::byte* means) {
  const auto blocks = static_cast<std::size_t>(layout.blocks.x);
  const std::int64_t across = samples_in(y, layout.factor, dims.y) * samples_in(z, layout.factor, dims.z);
  with_types(layout, [&]<class T, class S, class First>(T, S, First) {
    for (std::size_t x = 0; x < blocks; ++x) {
      S sum;
      std::memcpy(&sum, row.data() + x * sizeof(S), sizeof(S));
      T mean;
      if constexpr (std::is_floating_point_v<T>) {
        std::uint32_t count;
        std::memcpy(&count, row.data() + blocks * sizeof(S) + x * 4, 4);
        mean = mean_of<T>(sum, count);
      } else {
        mean = mean_of<T>(sum, across * samples_in(static_cast<std::int64_t>(x), layout.factor, dims.x));
      }
      std::memcpy(means + x * sizeof(T), &mean, sizeof(T));
    }
  });
}

}  // namespace tagrid
