#include "stages/rans_coder.h"

#include <array>

namespace tagrid {
namespace {

constexpr int state_bytes = 6;

// ceil(2^63 / length): by it, a state below 2^47 is divided exactly with one multiplication (T. Granlund and
// P. Montgomery, "Division by invariant integers using multiplication", 1994). A division would take longer than all
// else that is done for an event.
struct Reciprocals {
  std::array<std::uint64_t, 65536> of;
  Reciprocals() {
    of[0] = 0;
    for (std::uint64_t length = 1; length < of.size(); ++length)
      of[length] = ((std::uint64_t{1} << 63) + length - 1) / length;
  }
};

}  // namespace

void RansEncoder::finish() {
  static const Reciprocals reciprocals;
  std::uint64_t state = rans_low;
  std::vector<std::uint16_t> words;  // in the order of coding: the decoder wants the last first
  for (std::size_t i = events_.size(); i-- > 0;) {
    const std::uint64_t length = events_[i].length;
    if (state >= length * rans_low) {
      words.push_back(static_cast<std::uint16_t>(state));
      state >>= 16;
    }
    __extension__ using Wide = unsigned __int128;
    const auto quotient = static_cast<std::uint64_t>(Wide{state} * 2 * reciprocals.of[length] >> 64);
    // (quotient << 16) + state % length + start
    state += quotient * (65536 - length) + events_[i].start;
  }
  for (int byte = 0; byte < state_bytes; ++byte)
    out_.push_back(static_cast<std::uint8_t>(state >> (8 * byte)));
  for (std::size_t i = words.size(); i-- > 0;) {
    out_.push_back(static_cast<std::uint8_t>(words[i]));
    out_.push_back(static_cast<std::uint8_t>(words[i] >> 8));
  }
  events_.clear();
}

RansDecoder::RansDecoder(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
  state_ = take();
  state_ |= take() << 16;
  state_ |= take() << 32;
  if (state_ >= rans_low && state_ < rans_low << 16) return;
  // No encoder leaves such a state. Events can still be asked for, but all of the stream is broken.
  state_ = rans_low;
  position_ = bytes.size() + 2;
}

}  // namespace tagrid
