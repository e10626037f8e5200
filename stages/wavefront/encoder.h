// Encodes the values of a brick. Included once for each instruction set.
#if defined(TAGRID_STAGES_WAVEFRONT_ENCODER) == defined(HWY_TARGET_TOGGLE)
#ifdef TAGRID_STAGES_WAVEFRONT_ENCODER
#undef TAGRID_STAGES_WAVEFRONT_ENCODER
#else
#define TAGRID_STAGES_WAVEFRONT_ENCODER
#endif

#include <array>
#include <memory>
#include <vector>

#include "stages/wavefront/models.h"
#include "stages/wavefront/wave.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

/// Bits without a model: the low ones of large residuals.
struct LowBits {
  std::int16_t low[wave_lanes], count[wave_lanes];
};

/// They are added from the first to the last, and taken from the last to the first.
class LowBitsOfSteps {
 public:
  LowBits& add() {
    if (size_ % chunk == 0) chunks_.push_back(std::make_unique_for_overwrite<LowBits[]>(chunk));
    return chunks_.back()[size_++ % chunk];
  }
  const LowBits& take_last() {
    --size_;
    return chunks_[size_ / chunk][size_ % chunk];
  }

 private:
  static constexpr std::size_t chunk = 64;
  std::vector<std::unique_ptr<LowBits[]>> chunks_;
  std::size_t size_ = 0;
};

class Encoder : Wave<true> {
 public:
  Encoder(const WaveBrick& brick, WaveBuffers& buffers, RowReader reader, RowWriter writer)
      : Wave(brick, buffers, reader, writer, nullptr) {}

  void run(const BytesToCarry& to_carry, WaveCode& code) {
    BitWriter bits(code.bits);
    const Schedule& s = s_;
    const std::int64_t last = s.all_steps - 1, ring = 2 * s.period + 1;
    std::int64_t now = 0;
    for (std::int64_t group = 0, t = 0; t <= last; ++group) {
      begin_period(group);
      const std::int64_t end = std::min(t + s.period, last + 1);
      if (t == 0) {
        half_[0].record = buffers_.coded[0];
        front(half_[0], 0, 0);
      }
      for (; t < end; ++t) {
        if (t >= s.lag) {
          half_[1].record = buffers_.coded[1] + now;
          front(half_[1], 1, t - s.lag);
        }
        if (t < s.steps) back(half_[0], t);
        if (++now == ring) now = 0;
        if (t + 1 < s.steps) {
          half_[0].record = buffers_.coded[0] + now;
          front(half_[0], 0, t + 1);
        }
        if (t >= s.lag) back(half_[1], t - s.lag);
        if (t < 32 ? (t & (t + 1)) == 0 : t % 8 == 7) learn_biases();
      }
      // All rows of the period before have ended.
      if (group > 0) code_steps((group - 1) * s.period, group * s.period, bits);
      if (end == last + 1) code_steps(group * s.period, end, bits);
      finish_period(group);
    }
    for (std::int64_t group = (last / s.period) + 1; group < s.all_groups + 2; ++group) finish_period(group);
    bits.finish();
    code.quiet = std::move(buffers_.quiet);
    rans(to_carry, code);
  }

 private:
  void code_steps(std::int64_t from, std::int64_t to, BitWriter& bits) {
    const Schedule& s = s_;
    WaveBuffers& b = buffers_;
    std::int16_t* const tables = b.tables;
    const std::int64_t ring = 2 * s.period + 1;
    std::int64_t now = from % ring;
    // Of both halves, since the odd slices are behind.
    std::int64_t groups[2] = {from / s.period, (from - s.lag + s.slice) / s.period - s.groups};
    std::int64_t phases[2] = {0, from - s.lag - groups[1] * s.period};
    for (std::int64_t t = from; t < to; ++t, now = now + 1 == ring ? 0 : now + 1)
      for (int h = 0; h < 2; ++h) {
        IntervalLanes& lanes = b.interval_lanes[2 * t + h];
        lanes.coded = lanes.low = 0;
        const std::int64_t phase = phases[h], group = groups[h];
        if (++phases[h] == s.period) {
          phases[h] = 0;
          ++groups[h];
        }
        const std::int64_t own = t - (h == 0 ? 0 : s.lag);
        if (own < 0 || own >= s.steps) continue;
        const std::uint16_t* const q = b.quiet[static_cast<std::size_t>(h)].data() + group;
        const std::uint32_t begun = phase < wave_slope ? begun_bits(phase) : 0xffff;
        const std::uint32_t quiet = mixed(q[0], group > 0 ? q[-1] : 0xffff, begun);
        Coded& c = b.coded[h][now];
        const std::uint32_t m = c.lanes & ~quiet;
        if (m == 0) continue;
        lanes.coded = static_cast<std::uint16_t>(m);
        const I16 symbol = load16(c.symbol);
        lanes.first = static_cast<std::uint16_t>(bits_of_equal(symbol, 0));
        lanes.last = static_cast<std::uint16_t>(bits_of_equal(symbol, 15));
        std::int32_t* const interval = b.intervals[2 * t + h].of_lane;
        const auto read = [&](int i) HWY_ATTR {
          std::uint32_t p, q2;
          std::memcpy(&p, tables + c.texture[i] + c.symbol[i], 4);
          std::memcpy(&q2, level_tables_ + c.level[i] + c.symbol[i], 4);
          interval[i] = static_cast<std::int32_t>(p + q2);
        };
        if (std::popcount(m) > few_lanes) {
          const M16 in = mask16(m);
          store(if_else(in, load16(c.texture), set16(idle_texture * static_cast<int>(symbols))), c.texture);
          store(if_else(
                    in, load16(c.level),
                    set16((brick_.one_distribution ? idle_texture : idle_level) * static_cast<int>(symbols))),
                c.level);
          TAGRID_UNROLL
          for (int i = 0; i < wave_lanes; ++i) read(i);
        } else {
          for (std::uint32_t f = m; f != 0; f &= f - 1) read(std::countr_zero(f));
        }
        learn_symbols(tables, learning_levels(), c.texture, c.level, c.symbol, m);
        if ((c.extra & m) == 0) continue;
        for (std::uint32_t f = c.far & m; f != 0; f &= f - 1) {
          const int i = std::countr_zero(f);
          const std::int32_t high = c.turned[i] >> ((c.low >> i & 1) != 0 ? c.low_bits[i] : 0);
          bits.put(high < 0, 1);
          bits.put_number(static_cast<std::uint32_t>(std::abs(high) - 8));
        }
        if ((c.low & m) != 0) {
          lanes.low = static_cast<std::uint16_t>(c.low & m);
          LowBits& low = low_bits_.add();
          for (int i = 0; i < wave_lanes; ++i) {
            low.count[i] = c.low_bits[i];
            low.low[i] = static_cast<std::int16_t>(c.turned[i] & ((1 << c.low_bits[i]) - 1));
          }
        }
      }
  }
  static std::uint32_t bits_of_equal(I16 a, int value) { return HWY_NAMESPACE::bits(a == set16(value)); }

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
  void rans(const BytesToCarry& to_carry, WaveCode& code) {
    std::size_t coded = 0;
    for (std::int64_t e = 0; e < 2 * s_.all_steps; ++e)
      coded += static_cast<std::size_t>(std::popcount(buffers_.interval_lanes[e].coded));
    code.single = coded <= single_state_symbols;
    WordsBackward words;
    std::array<std::uint32_t, 2 * wave_lanes> all;
    const std::size_t states = code.single ? 1 : all.size();
    all.fill(65536);
    if (const auto bytes = to_carry ? to_carry() : std::span<const std::uint8_t>();
        bytes.size() >= 2 * states) {
      for (std::size_t i = 0; i < states; ++i) all[i] += bytes[2 * i] + 256u * bytes[2 * i + 1];
      code.carried = 2 * states;
    }
    if (code.single)
      push_one_by_one(words, all[0]);
    else
      push_all(words, all);
    code.words.resize(2 * states + words.size());
    std::memcpy(code.words.data(), all.data(), states * sizeof all[0]);
    words.copy_to(code.words.data() + 2 * states);
  }

  /// All symbols into one state, the last lane of the last step first.
  void push_one_by_one(WordsBackward& words, std::uint32_t& state) {
    const auto push_one = [&](std::uint32_t start, std::uint32_t length) {
      if (state >> 16 >= length) {
        *--words.room() = static_cast<std::uint16_t>(state);
        state >>= 16;
      }
      state = (state / length << 16) + state % length + start;
    };
    for (std::int64_t e = 2 * s_.all_steps; e-- > 0;) {
      const IntervalLanes& lanes = buffers_.interval_lanes[e];
      if (lanes.coded == 0) continue;
      if (lanes.low != 0) {
        const LowBits& low = low_bits_.take_last();
        for (int i = wave_lanes; i-- > 0;)
          if ((lanes.low >> i & 1) != 0)
            push_one(static_cast<std::uint32_t>(low.low[i]) << (16 - low.count[i]), 65536u >> low.count[i]);
      }
      for (int i = wave_lanes; i-- > 0;)
        if ((lanes.coded >> i & 1) != 0) {
          const auto interval = static_cast<std::uint32_t>(buffers_.intervals[e].of_lane[i]);
          const std::uint32_t start = (lanes.first >> i & 1) != 0 ? 0 : interval & 0xffff;
          push_one(start, ((lanes.last >> i & 1) != 0 ? 65536 : interval >> 16) - start);
        }
    }
  }

  /// The symbols of a step into sixteen states, those of the other half into sixteen more.
  void push_all(WordsBackward& words, std::array<std::uint32_t, 2 * wave_lanes>& all) {
    const Schedule& s = s_;
    const WaveBuffers& b = buffers_;
    alignas(64) std::int32_t of_lane[2 * wave_lanes];
    std::memcpy(of_lane, all.data(), sizeof of_lane);
    I32 states[2] = {load32(of_lane), load32(of_lane + wave_lanes)};
    for (std::int64_t e = 2 * s.all_steps; e-- > 0;) {
      const IntervalLanes& lanes = b.interval_lanes[e];
      if (lanes.coded == 0) continue;
      I32& state = states[e & 1];
      if (lanes.low != 0) {
        const LowBits& low = low_bits_.take_last();
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

  LowBitsOfSteps low_bits_;
};

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
