// New numbers for those things that are kept, in the same order.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tagrid {

class KeptNumbers {
 public:
  /// One bit and half a bit for each of them.
  static std::uint64_t bytes(std::int64_t count) { return static_cast<std::uint64_t>(count) / 16 * 3 + 64; }

  explicit KeptNumbers(std::int64_t count) : bits_(static_cast<std::size_t>(count + 63) / 64) {}

  void keep(std::int64_t number) { bits_[word(number)] |= bit(number); }
  bool is_kept(std::int64_t number) const { return (bits_[word(number)] & bit(number)) != 0; }
  /// To be called once, after the last keep().
  void count() {
    for (std::size_t i = 0; i < bits_.size(); ++i) {
      if (i % words_of_sum == 0) sums_.push_back(total_);
      total_ += std::popcount(bits_[i]);
    }
  }
  /// How many are kept. REQUIRES: count() was called.
  std::int64_t total() const { return total_; }
  /// The new number. REQUIRES: count() was called; the number is kept.
  std::int64_t of(std::int64_t number) const {
    std::int64_t sum = sums_[word(number) / words_of_sum];
    for (std::size_t i = word(number) / words_of_sum * words_of_sum; i < word(number); ++i)
      sum += std::popcount(bits_[i]);
    return sum + std::popcount(bits_[word(number)] & (bit(number) - 1));
  }

 private:
  static constexpr std::size_t words_of_sum = 2;
  static std::size_t word(std::int64_t number) { return static_cast<std::size_t>(number) / 64; }
  static std::uint64_t bit(std::int64_t number) { return std::uint64_t{1} << (number % 64); }

  std::vector<std::uint64_t> bits_;
  std::vector<std::int64_t> sums_;  ///< those kept before each group of words
  std::int64_t total_ = 0;
};

}  // namespace tagrid
