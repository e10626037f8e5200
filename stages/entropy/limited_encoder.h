// An encoder for code that is one of several: it gives up when the code becomes too long to be chosen.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/entropy/rans_coder.h"

namespace tagrid {

/// Codes about `most` events: callers ask exhausted() from time to time, and then stop.
class LimitedEncoder {
 public:
  static constexpr bool encoding = true;
  LimitedEncoder(std::vector<std::uint8_t>& out, std::uint64_t most) : coder_(out), left_(most) {}

  bool code(bool bit, std::uint32_t p) {
    count();
    return coder_.code(bit, p);
  }
  std::uint32_t code_raw(std::uint32_t value, int bits) {
    count();
    return coder_.code_raw(value, bits);
  }
  bool exhausted() const { return left_ == 0; }
  void finish() { coder_.finish(); }

 private:
  void count() { left_ -= left_ > 0; }

  RansEncoder coder_;
  std::uint64_t left_;
};

}  // namespace tagrid
