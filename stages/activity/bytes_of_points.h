// Turns words of bits into bytes, one for each point.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tagrid {

/// One byte for each of 64 points, made from eight words: bit k of byte i is bit i of word k.
class BytesOfPoints {
 public:
  using Words = std::array<std::uint64_t, 8>;

  void transpose(const Words& words);
  std::size_t operator[](int i) const { return bytes_[static_cast<std::size_t>(i)]; }

 private:
  alignas(64) std::array<std::uint8_t, 64> bytes_;
};

}  // namespace tagrid
