#include "stages/entropy/rans_coder.h"

#include <algorithm>

#include "stages/entropy/reciprocals.h"

namespace tagrid {
namespace {

constexpr int state_bytes = 6;

}  // namespace

void RansEncoder::grow() {
  capacity_ = std::max<std::size_t>(2 * capacity_, 64);
  auto more = std::make_unique_for_overwrite<Interval[]>(capacity_);
  std::copy_n(events_.get(), count_, more.get());
  events_ = std::move(more);
}

void RansEncoder::finish() {
  static const Reciprocals reciprocals;
  std::uint64_t state = rans_low;
  // No event adds more than one word. Words are filled from the end on: the decoder wants the last word
  // first.
  const auto words = std::make_unique_for_overwrite<std::uint16_t[]>(count_);
  std::size_t first_word = count_;
  for (std::size_t i = count_; i-- > 0;) {
    const std::uint64_t length = events_[i].length;
    if (state >= length * rans_low) {
      words[--first_word] = static_cast<std::uint16_t>(state);
      state >>= 16;
    }
    const std::uint64_t quotient = reciprocals.divide(state, length);
    // (quotient << 16) + state % length + start
    state += quotient * (65536 - length) + events_[i].start;
  }
  std::size_t at = out_.size();
  out_.resize(at + state_bytes + 2 * (count_ - first_word));
  for (int byte = 0; byte < state_bytes; ++byte) out_[at++] = static_cast<std::uint8_t>(state >> (8 * byte));
  for (std::size_t i = first_word; i < count_; ++i) {
    out_[at++] = static_cast<std::uint8_t>(words[i]);
    out_[at++] = static_cast<std::uint8_t>(words[i] >> 8);
  }
  count_ = 0;
}

RansDecoder::RansDecoder(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
  state_ = take();
  state_ |= take() << 16;
  state_ |= take() << 32;
  if (state_ >= rans_low && state_ < rans_low << 16) return;
  // No encoder writes such a state. Events can still be decoded, but the whole stream is broken.
  state_ = rans_low;
  position_ = bytes.size() + 2;
}

}  // namespace tagrid
