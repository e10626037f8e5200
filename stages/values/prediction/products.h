// Sums of products of rows, for least squares: exact in integers, with the vector instructions that the
// machine has.
#pragma once

#include <array>
#include <cstdint>

namespace tagrid {

/// Adds up the products of every two of some rows.
class ProductSums {
 public:
  static constexpr int most_rows = 19;
  /// Numbers of a row at a time.
  static constexpr std::int64_t chunk = 32;
  /// Numbers of larger magnitude would need to be carried too often.
  static constexpr std::int64_t magnitude_limit = 8191;

  /// `rows`: of these products. REQUIRES: rows <= most_rows, magnitude <= magnitude_limit.
  ProductSums(int rows, std::int64_t magnitude);

  /// One chunk of each row. REQUIRES: no number is above the magnitude.
  void add(const std::int16_t (*numbers)[chunk]);
  /// The sum of products of rows i and j <= i, at i * (i + 1) / 2 + j.
  const std::int64_t* totals();

 private:
  static constexpr int pairs = most_rows * (most_rows + 1) / 2;
  static constexpr int lanes = 16;

  using AddProducts = void (*)(const std::int16_t (*numbers)[chunk], int rows, std::int32_t (*parts)[lanes]);

  void carry();

  AddProducts add_products_;  ///< for the instruction sets of this machine
  int rows_;
  std::int64_t limit_;        ///< chunks before the parts may overflow
  std::int64_t pending_ = 0;  ///< chunks in the parts
  std::array<std::array<std::int32_t, lanes>, pairs> parts_{};
  std::array<std::int64_t, pairs> totals_{};
};

}  // namespace tagrid
