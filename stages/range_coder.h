// Binary range coder. 64-bit interval, 16-bit probabilities, bytes leave four at a time, so that the branch
// that emits them is rare and predictable. The method is G. N. N. Martin's range encoding (1979) with the
// carry propagated into bytes already written.
//
// Both directions have the same member functions: code(bit, p) returns the bit, given by the caller when
// encoding and ignored when decoding. A model is thus written once, as a template over the coder.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tagrid {

inline constexpr int probability_bits = 16;

/// Appends to `out`. Nothing is complete before finish().
class RangeEncoder {
 public:
  static constexpr bool encoding = true;

  explicit RangeEncoder(std::vector<std::uint8_t>& out) : out_(out), start_(out.size()) {}

  /// Codes `bit`, whose probability of being one is `p` / 65536. REQUIRES: 0 < p < 65536.
  bool code(bool bit, std::uint32_t p) {
    const std::uint64_t bound = (range_ >> probability_bits) * p;
    if (bit) {
      range_ = bound;
    } else {
      add(bound);
      range_ -= bound;
    }
    if (range_ < (std::uint64_t{1} << 32)) shift();
    return bit;
  }

  /// Codes the low `bits` bits of `value`, all equally probable. REQUIRES: bits <= 16, value < 2^bits.
  std::uint32_t code_raw(std::uint32_t value, int bits) {
    range_ >>= bits;
    add(range_ * value);
    if (range_ < (std::uint64_t{1} << 32)) shift();
    return value;
  }

  /// Four more bytes, enough to name a point of the interval whatever follows.
  void finish() {
    add((std::uint64_t{1} << 32) - 1);
    shift();
  }

 private:
  void add(std::uint64_t amount) {
    low_ += amount;
    if (low_ < amount) carry();
  }
  void carry() {
    std::size_t i = out_.size();
    while (i > start_ && ++out_[--i] == 0) {
    }
  }
  void shift() {
    const auto top = static_cast<std::uint32_t>(low_ >> 32);
    for (int byte = 24; byte >= 0; byte -= 8) out_.push_back(static_cast<std::uint8_t>(top >> byte));
    low_ <<= 32;
    range_ <<= 32;
  }

  std::vector<std::uint8_t>& out_;
  std::size_t start_;
  std::uint64_t low_ = 0;
  std::uint64_t range_ = ~std::uint64_t{0};
};

/// Reads what RangeEncoder wrote. Safe on any bytes: past the end it reads zeros, and finished() tells.
class RangeDecoder {
 public:
  static constexpr bool encoding = false;

  explicit RangeDecoder(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
    code_ = take();
    code_ = code_ << 32 | take();
  }

  bool code(bool, std::uint32_t p) {
    const std::uint64_t bound = (range_ >> probability_bits) * p;
    const bool bit = code_ < bound;
    if (bit) {
      range_ = bound;
    } else {
      code_ -= bound;
      range_ -= bound;
    }
    if (range_ < (std::uint64_t{1} << 32)) shift();
    return bit;
  }

  std::uint32_t code_raw(std::uint32_t, int bits) {
    range_ >>= bits;
    const std::uint64_t last = (std::uint64_t{1} << bits) - 1;
    const std::uint64_t value = std::min(code_ / range_, last);
    code_ -= value * range_;
    if (range_ < (std::uint64_t{1} << 32)) shift();
    return static_cast<std::uint32_t>(value);
  }

  /// True if exactly the bytes that the encoder wrote have been used: the four bytes of finish() are the
  /// first half of what lies ahead of the decoder.
  bool finished() const { return position_ == bytes_.size() + 4; }
  /// True once more bytes were asked for than any complete stream has; the rest is not worth decoding.
  bool exhausted() const { return position_ > bytes_.size() + 4; }

 private:
  std::uint64_t take() {
    std::uint64_t word = 0;
    for (int i = 0; i < 4; ++i, ++position_)
      word = word << 8 | (position_ < bytes_.size() ? bytes_[position_] : 0);
    return word;
  }
  void shift() {
    code_ = code_ << 32 | take();
    range_ <<= 32;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t position_ = 0;
  std::uint64_t code_ = 0;
  std::uint64_t range_ = ~std::uint64_t{0};
};

}  // namespace tagrid
