// Decodes the values of a brick.
#pragma once

#include <array>
#include <cstddef>

#include "stages/values/wavefront/bits.h"
#include "stages/values/wavefront/models.h"
#include "stages/values/wavefront/step.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

class Decoder : Wave<false> {
 public:
  Decoder(const WaveBrick& brick, WaveBuffers& buffers, const WaveBytes& code, RowWriter writer)
      : Wave(brick, buffers, {}, writer, &code.quiet),
        single_(code.single),
        carries_(code.carries),
        bits_(code.bits),
        words_(code.words.data()),
        end_(code.words.data() + code.words.size()) {}

  bool run(std::vector<std::uint8_t>& carried) {
    const Schedule& s = s_;
    if (end_ - words_ < most_of_steps) enough_words();
    if (single_) {
      std::memcpy(&one_state_, words_, sizeof one_state_);
      words_ += sizeof one_state_;
    } else {
      alignas(64) std::int32_t states[2 * wave_lanes];
      std::memcpy(states, words_, sizeof states);
      half_[0].decoding.state = load32(states);
      half_[1].decoding.state = load32(states + wave_lanes);
      words_ += sizeof states;
    }
    const Schedule wanted({s.size.x, s.size.y, writer_.slices});
    const std::int64_t last = wanted.all_steps - 1;
    for (std::int64_t group = 0, t = 0; t <= last; ++group) {
      begin_period(group);
      const std::int64_t end = std::min(t + s.period, last + 1);
      if (t == 0) front(half_[0], 0, 0);
      for (; t < end; ++t) {
        if (t >= s.lag) front(half_[1], 1, t - s.lag);
        if (t < s.steps) step(half_[0], t);
        if (t + 1 < s.steps) front(half_[0], 0, t + 1);
        if (t >= s.lag) step(half_[1], t - s.lag);
        if (end_ - words_ < most_of_steps && !enough_words()) return false;
        if (t < 32 ? (t & (t + 1)) == 0 : t % 8 == 7) biases_.learn();
      }
      finish_period(group);
    }
    for (std::int64_t group = (last / s.period) + 1; group < wanted.all_groups + 2; ++group)
      finish_period(group);
    if (writer_.slices < s.size.z) return true;
    return words_ == end_ && bits_.finished() && is_at_start(carried);
  }

 private:
  /// Whether the states are such as the encoder began with: 65536, and what they carry.
  bool is_at_start(std::vector<std::uint8_t>& carried) const {
    alignas(64) std::int32_t of_lane[2 * wave_lanes];
    store(half_[0].decoding.state, of_lane);
    store(half_[1].decoding.state, of_lane + wave_lanes);
    for (std::size_t i = 0; i < (single_ ? 1 : 2 * wave_lanes); ++i) {
      const std::uint32_t state = single_ ? one_state_ : static_cast<std::uint32_t>(of_lane[i]);
      if (state >> 16 != 1 || (!carries_ && state != 65536)) return false;
      if (!carries_) continue;
      carried.push_back(static_cast<std::uint8_t>(state));
      carried.push_back(static_cast<std::uint8_t>(state >> 8));
    }
    return true;
  }
  /// Bytes that the steps of both halves may read: a word for each symbol, one for its low bits, and what
  /// a vector reads.
  static constexpr std::ptrdiff_t most_of_steps = 2 * 4 * wave_lanes + 32;

  /// Near the end, goes on in a copy that is followed by zeros. Returns false if words after the end were
  /// asked for.
  bool enough_words() {
    if (!at_end_) {
      at_end_ = true;
      const auto left = static_cast<std::size_t>(end_ - words_);
      tail_.fill(0);
      std::memcpy(tail_.data(), words_, left);
      words_ = tail_.data();
      end_ = words_ + left;
    }
    return words_ <= end_;
  }

  TAGRID_STEP void step(Half& f, std::int64_t t) {
    if (f.predicted.slow) {
      if (f.decoding.coded != 0)
        read_residuals(f);
      else
        f.residual = set32(0);
    }
    back(f, t);
  }

  /// The residuals of a step.
  TAGRID_STEP void read_residuals(Half& f) {
    Decoding& s = f.decoding;
    I32 low = set32(0);
    if (single_)
      take_one_by_one(s, low);
    else
      take_all(s, low);
    // All lanes have read; now all learn.
    learn_symbols(buffers_.tables, learning_levels(), s.texture, s.level, s.symbol, s.coded);
    const std::uint32_t m = s.coded;
    const M32 in = mask32(m);
    const I32 symbol = load32(s.symbol);
    I32 residual = if_or_zero(in, symbol - set32(7));
    const std::uint32_t far = bits(symbol == set32(15)) & m;
    if ((far | s.any_low) != 0) {
      if (far != 0) {
        alignas(64) std::int32_t all[wave_lanes];
        store(residual, all);
        for (std::uint32_t b = far; b != 0; b &= b - 1) {
          const bool is_negative_one = bits_.get(1) != 0;
          const auto magnitude = static_cast<std::int32_t>(8 + bits_.get_number());
          all[std::countr_zero(b)] = is_negative_one ? -magnitude : magnitude;
        }
        residual = load32(all);
      }
      if (s.any_low != 0) residual = shift_left(residual, if_or_zero(mask32(s.any_low), s.low_bits)) + low;
    }
    residual = max(min(residual, s.largest), negative(s.largest));
    f.residual = if_else(f.predicted.flip, negative(residual), residual);
  }

  /// The symbol of lane i, and its interval, from the lower half of a state.
  TAGRID_STEP void read(Decoding& s, int i, std::uint32_t slot) {
    const std::int16_t *const texture = buffers_.tables + s.texture[i], *const level =
                                                                            level_tables_ + s.level[i];
    // Element 0 is an age.
    const M16 begun = not_above(load16(texture) + load16(level), set16(static_cast<std::int16_t>(slot)));
    const auto symbol = std::popcount(bits(begun) & 0xfffe);
    std::uint32_t p, q;
    std::memcpy(&p, texture + symbol, sizeof p);
    std::memcpy(&q, level + symbol, sizeof q);
    s.interval[i] = static_cast<std::int32_t>(p + q);
    s.symbol[i] = symbol;
  }

  /// All lanes at once, each from its state.
  TAGRID_STEP void take_all(Decoding& s, I32& low) {
    alignas(64) std::int32_t state[wave_lanes];
    store(s.state, state);
    if (std::popcount(s.coded) > few_lanes) {
      TAGRID_UNROLL
      for (int i = 0; i < wave_lanes; ++i) read(s, i, static_cast<std::uint32_t>(state[i]));
    } else {
      for (std::uint32_t b = s.coded; b != 0; b &= b - 1) {
        const int i = std::countr_zero(b);
        read(s, i, static_cast<std::uint32_t>(state[i]));
      }
    }
    const I32 symbol = load32(s.symbol), interval = load32(s.interval);
    const I32 start = zero_or(symbol == set32(0), interval & set32(0xffff));
    const I32 end = if_else(symbol == set32(15), set32(65536), shift_right_unsigned<16>(interval));
    advance(s.state, start, end - start, s.coded);
    if (s.any_low == 0) return;
    const M32 has = mask32(s.any_low);
    const I32 room = set32(16) - if_or_zero(has, s.low_bits);
    low = if_or_zero(has, shift_right(s.state & set32(0xffff), room));
    advance(s.state, shift_left(low, room), shift_left(set32(1), room), s.any_low);
  }

  /// One lane after the other, all from the same state.
  void take_one_by_one(Decoding& s, I32& low) {
    const auto advance_one = [this](std::uint32_t start, std::uint32_t length) {
      one_state_ = (one_state_ >> 16) * length + (one_state_ & 0xffff) - start;
      if (one_state_ < 65536) {
        std::uint16_t word;
        std::memcpy(&word, words_, sizeof word);
        words_ += sizeof word;
        one_state_ = one_state_ << 16 | word;
      }
    };
    for (std::uint32_t b = s.coded; b != 0; b &= b - 1) {
      const int i = std::countr_zero(b);
      read(s, i, one_state_ & 0xffff);
      const auto interval = static_cast<std::uint32_t>(s.interval[i]);
      const std::uint32_t start = s.symbol[i] == 0 ? 0 : interval & 0xffff;
      advance_one(start, (s.symbol[i] == 15 ? 65536 : interval >> 16) - start);
    }
    if (s.any_low == 0) return;
    alignas(64) std::int32_t count[wave_lanes], all[wave_lanes] = {};
    store(s.low_bits, count);
    for (std::uint32_t b = s.any_low; b != 0; b &= b - 1) {
      const int i = std::countr_zero(b), room = 16 - count[i];
      const std::uint32_t bits_below = (one_state_ & 0xffff) >> room;
      all[i] = static_cast<std::int32_t>(bits_below);
      advance_one(bits_below << room, 1u << room);
    }
    low = load32(all);
  }

  TAGRID_STEP void advance(I32& state, I32 start, I32 length, std::uint32_t m) {
    const I32 moved = shift_right_unsigned<16>(state) * length + (state & set32(0xffff)) - start;
    state = if_else(mask32(m), moved, state);
    const std::uint32_t low = bits(shift_right_unsigned<16>(state) == set32(0)) & m;
    if (low == 0) return;
    state = if_else(mask32(low), shift_left<16>(state) | take_words(words_, low), state);
    words_ += 2 * std::popcount(low);
  }
  const bool single_, carries_;
  std::uint32_t one_state_ = 0;
  BitReader bits_;
  const std::uint8_t *words_, *end_;
  bool at_end_ = false;
  std::array<std::uint8_t, 2 * most_of_steps> tail_;
};

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
