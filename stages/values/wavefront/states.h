// Pushes the symbols of a brick into the states of its lanes.
#pragma once

#include <array>
#include <bit>
#include <cstring>

#include "stages/values/wavefront/coder.h"
#include "stages/values/wavefront/vectors.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

/// The states take in the symbols from the last to the first, as a decoder takes them out from the first to
/// the last.
class States {
 public:
  explicit States(WaveSymbols& symbols)
      : symbols_(symbols), entries_(2 * symbols.buffers.schedule.all_steps) {}

  WaveCode run(std::span<const std::uint8_t> to_carry) {
    std::size_t coded = 0;
    for (std::int64_t e = 0; e < entries_; ++e)
      coded += static_cast<std::size_t>(std::popcount(symbols_.buffers.interval_lanes[e].coded));
    WaveCode code;
    code.single = coded <= single_state_symbols;
    WordsBackward words;
    std::array<std::uint32_t, 2 * wave_lanes> all;
    const std::size_t states = code.single ? 1 : all.size();
    all.fill(65536);
    if (to_carry.size() >= 2 * states) {
      for (std::size_t i = 0; i < states; ++i) all[i] += to_carry[2 * i] + 256u * to_carry[2 * i + 1];
      code.carried = 2 * states;
    }
    if (code.single)
      push_one_by_one(words, all[0]);
    else
      push_all(words, all);
    code.words.resize(2 * states + words.size());
    std::memcpy(code.words.data(), all.data(), states * sizeof all[0]);
    words.copy_to(code.words.data() + 2 * states);
    return code;
  }

 private:
  /// All symbols into one state, the last lane of the last step first.
  void push_one_by_one(WordsBackward& words, std::uint32_t& state) {
    const auto push_one = [&](std::uint32_t start, std::uint32_t length) {
      if (state >> 16 >= length) {
        *--words.room() = static_cast<std::uint16_t>(state);
        state >>= 16;
      }
      state = (state / length << 16) + state % length + start;
    };
    for (std::int64_t e = entries_; e-- > 0;) {
      const IntervalLanes& lanes = symbols_.buffers.interval_lanes[e];
      if (lanes.coded == 0) continue;
      if (lanes.low != 0) {
        const LowBits& low = symbols_.low_bits.take_last();
        for (int i = wave_lanes; i-- > 0;)
          if ((lanes.low >> i & 1) != 0)
            push_one(static_cast<std::uint32_t>(low.low[i]) << (16 - low.count[i]), 65536u >> low.count[i]);
      }
      for (int i = wave_lanes; i-- > 0;)
        if ((lanes.coded >> i & 1) != 0) {
          const auto interval = static_cast<std::uint32_t>(symbols_.buffers.intervals[e].of_lane[i]);
          const std::uint32_t start = (lanes.first >> i & 1) != 0 ? 0 : interval & 0xffff;
          push_one(start, ((lanes.last >> i & 1) != 0 ? 65536 : interval >> 16) - start);
        }
    }
  }

  /// The symbols of a step into sixteen states, those of the other half into sixteen more.
  void push_all(WordsBackward& words, std::array<std::uint32_t, 2 * wave_lanes>& all) {
    const WaveBuffers& b = symbols_.buffers;
    alignas(64) std::int32_t of_lane[2 * wave_lanes];
    std::memcpy(of_lane, all.data(), sizeof of_lane);
    I32 states[2] = {load32(of_lane), load32(of_lane + wave_lanes)};
    for (std::int64_t e = entries_; e-- > 0;) {
      const IntervalLanes& lanes = b.interval_lanes[e];
      if (lanes.coded == 0) continue;
      I32& state = states[e & 1];
      if (lanes.low != 0) {
        const LowBits& low = symbols_.low_bits.take_last();
        const I32 count = widen(load16(low.count)), room = set32(16) - count;
        push(shift_left(widen(load16(low.low)), room), shift_left(set32(1), room), lanes.low, state, words);
      }
      const I32 interval = load32(b.intervals[e].of_lane);
      const I32 start = zero_or(mask32(lanes.first), interval & set32(0xffff));
      const I32 stop = if_else(mask32(lanes.last), set32(65536), shift_right_unsigned<16>(interval));
      push(start, stop - start, lanes.coded, state, words);
    }
    store(states[0], of_lane);
    store(states[1], of_lane + wave_lanes);
    std::memcpy(all.data(), of_lane, sizeof of_lane);
  }

  /// Codes intervals of the lanes `m` into the states.
  TAGRID_STEP void push(I32 start, I32 length, std::uint32_t m, I32& state, WordsBackward& words) {
    const M32 in = mask32(m);
    length = if_else(in, length, set32(65535));
    const std::uint32_t full = bits(shift_right_unsigned<16>(state) >= length) & m;
    if (full != 0) {
      std::uint16_t*& first = words.room();
      first = give_words(state, full, first);
      state = if_else(mask32(full), shift_right_unsigned<16>(state), state);
    }
    // Twice the half is less by at most 1, so the quotient is off by at most 1.
    I32 quotient =
        nearest((to_float(shift_right_unsigned<1>(state)) + to_float(shift_right_unsigned<1>(state))) /
                to_float(length));
    I32 rest = state - quotient * length;
    const M32 below = is_negative(rest);
    quotient = quotient - if_or_zero(below, set32(1));
    rest = rest + if_or_zero(below, length);
    const M32 above = rest >= length;
    quotient = quotient + if_or_zero(above, set32(1));
    rest = rest - if_or_zero(above, length);
    state = if_else(in, shift_left<16>(quotient) + rest + start, state);
  }

  WaveSymbols& symbols_;
  std::int64_t entries_;  ///< steps of both halves
};

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
