// Sums of blocks of samples, from which the means of overviews follow. docs/dev/format.md (3.6) defines the means.
//
// A block has 4 samples along each axis, or 4 blocks of the level before; the last ones along an axis may have
// fewer. Sums of integers are exact. Sums of floats depend on the order of their additions, which is therefore
// the same however slices come: first along each column of a block (y fastest, then z), then over the columns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// Samples, or blocks of the level before, along the edge of a block.
inline constexpr std::int64_t block_edge = 4;
/// The largest edge of a block in samples: sums of 32-bit samples stay below 2^63.
inline constexpr std::int64_t largest_factor = 1024;

/// Number of blocks along an axis with `count` samples, or blocks of the level before.
constexpr std::int64_t blocks_along(std::int64_t count) { return (count + block_edge - 1) / block_edge; }

/// How the sums of blocks of `factor` samples along each axis are stored: rows of sums (int32 for samples of 8
/// and 16 bits and blocks of 4, int64 for other integers, float64 for floats), and for floats then the row of
/// counts (uint32) of finite samples.
struct SumsLayout {
  SampleType type = SampleType::uint8;
  std::int64_t factor = block_edge;
  Index3 blocks;  ///< of the whole volume

  std::size_t sum_bytes() const { return factor == block_edge && !is_wide_type(type) ? 4 : 8; }
  std::size_t count_bytes() const { return is_float_type(type) ? 4 : 0; }
  std::size_t row_bytes() const { return static_cast<std::size_t>(blocks.x) * (sum_bytes() + count_bytes()); }
};
/// The layout for a volume. REQUIRES: factor is a power of 4 from 4 to largest_factor.
SumsLayout layout_of_sums(const Index3& dims, SampleType type, std::int64_t factor);

/// Adds slices of a slab, which are 4 or fewer, to sums of its blocks. The memory is that of one slice of sums
/// of columns; see memory().
class SlabSums {
 public:
  /// The sums of blocks of a level, from `rows` complete rows of samples (factor 4), or of sums of the level
  /// before. The first row begins a block.
  SlabSums(const SumsLayout& layout, std::int64_t width, std::int64_t rows);

  /// Adds the samples, or the stored sums, of a slice.
  void add_slice(const std::byte* slice) { add_rows(slice, 0, rows_); }
  /// The same for rows y_low .. y_end - 1 of a slice. Threads can add different rows at once. REQUIRES: y_low is a
  /// multiple of block_edge, and so is y_end, unless it is the number of rows.
  void add_rows(const std::byte* slice, std::int64_t y_low, std::int64_t y_end);
  /// Gives the rows of the sums of the blocks, and begins the next slab.
  void take(std::vector<std::byte>& rows);

  static std::uint64_t memory(const SumsLayout& layout, std::int64_t width, std::int64_t rows);

 private:
  SumsLayout layout_;
  std::int64_t width_, rows_;
  std::vector<std::byte> sums_;        ///< of columns
  std::vector<std::uint32_t> counts_;  ///< of finite samples in columns; empty for integers
};

/// The means of a row of blocks as samples: rounded to the nearest integer, and up in the middle; for floats
/// the quotient of sum and count, rounded to the type, and NaN for a block without a finite sample or with a
/// sum that is not finite. `row` is as stored; y and z are the numbers of the block along these axes.
void means_of_row(const SumsLayout& layout, const Index3& dims, std::int64_t y, std::int64_t z,
                  std::span<const std::byte> row, std::byte* means);

}  // namespace tagrid
