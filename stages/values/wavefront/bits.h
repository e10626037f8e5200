// Bits without a model, least significant first.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tagrid {

class BitWriter {
 public:
  explicit BitWriter(std::vector<std::uint8_t>& out) : out_(out) {}

  /// REQUIRES: bits <= 32, value < 2^bits.
  void put(std::uint32_t value, int bits) {
    pending_ |= std::uint64_t{value} << count_;
    for (count_ += bits; count_ >= 8; count_ -= 8, pending_ >>= 8)
      out_.push_back(static_cast<std::uint8_t>(pending_));
  }
  /// An exponential Golomb code: the length in unary, then the digits.
  void put_number(std::uint32_t value) {
    value += 4;
    const int digits = std::bit_width(value) - 1;
    for (int i = 2; i < digits; ++i) put(1, 1);
    put(0, 1);
    put(value & ((1u << digits) - 1), digits);
  }
  void finish() {
    if (count_ > 0) out_.push_back(static_cast<std::uint8_t>(pending_));
  }

 private:
  std::vector<std::uint8_t>& out_;
  std::uint64_t pending_ = 0;
  int count_ = 0;
};

/// Past the end, it reads zeros, and finished() is false.
class BitReader {
 public:
  explicit BitReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  std::uint32_t get(int bits) {
    while (count_ < bits) {
      pending_ |= (at_ < bytes_.size() ? std::uint64_t{bytes_[at_]} : 0) << count_;
      ++at_;
      count_ += 8;
    }
    const auto value = static_cast<std::uint32_t>(pending_ & ((std::uint64_t{1} << bits) - 1));
    pending_ >>= bits;
    count_ -= bits;
    return value;
  }
  /// Numbers of the writer are below 2^18; others are limited to that.
  std::uint32_t get_number() {
    int digits = 2;
    while (digits < 18 && get(1) != 0) ++digits;
    return (get(digits) | 1u << digits) - 4;
  }
  bool finished() const { return at_ == bytes_.size() && pending_ == 0; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  std::uint64_t pending_ = 0;
  int count_ = 0;
};

}  // namespace tagrid
