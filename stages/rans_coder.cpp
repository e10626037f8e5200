#include "stages/rans_coder.h"

#include "stages/reciprocals.h"

namespace tagrid {
namespace {

constexpr int state_bytes = 6;

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
    const std::uint64_t quotient = reciprocals.divide(state, length);
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
