#include "stages/entropy/rans_coder.h"

namespace tagrid {
namespace {

constexpr int state_bytes = 6;

}  // namespace

void RansEncoder::begin_chunk() {
  chunks_.push_back(std::make_unique_for_overwrite<Interval[]>(chunk_size));
  events_ = chunks_.back().get();
  count_ = 0;
}

void RansEncoder::finish() {
  static const Reciprocals reciprocals;
  std::uint64_t state = rans_low;
  // No event makes more than one word. From the end on: the decoder wants the last word first.
  const std::size_t most = chunks_.empty() ? 0 : (chunks_.size() - 1) * chunk_size + count_;
  const auto words = std::make_unique_for_overwrite<std::uint16_t[]>(most);
  std::size_t first_word = most;
  for (; !chunks_.empty(); chunks_.pop_back(), count_ = chunk_size) {
    const Interval* const events = chunks_.back().get();
    for (std::size_t i = count_; i-- > 0;) {
      const std::uint64_t length = events[i].length;
      if (state >= length * rans_low) {
        words[--first_word] = static_cast<std::uint16_t>(state);
        state >>= 16;
      }
      const std::uint64_t quotient = reciprocals.divide(state, length);
      // (quotient << 16) + state % length + start
      state += quotient * (65536 - length) + events[i].start;
    }
  }
  std::size_t at = out_.size();
  out_.resize(at + state_bytes + 2 * (most - first_word));
  for (int byte = 0; byte < state_bytes; ++byte) out_[at++] = static_cast<std::uint8_t>(state >> (8 * byte));
  for (std::size_t i = first_word; i < most; ++i) {
    out_[at++] = static_cast<std::uint8_t>(words[i]);
    out_[at++] = static_cast<std::uint8_t>(words[i] >> 8);
  }
}

RansDecoder::RansDecoder(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
  state_ = take();
  state_ |= take() << 16;
  state_ |= take() << 32;
  if (state_ >= rans_low && state_ < rans_low << 16) return;
  // No encoder writes such a state: events can be decoded, but the stream is broken.
  state_ = rans_low;
  position_ = bytes.size() + 2;
}

}  // namespace tagrid
