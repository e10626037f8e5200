// Encodes the values of a brick as intervals of its symbols.
#pragma once

#include <bit>
#include <cstdlib>
#include <vector>

#include "stages/values/wavefront/bits.h"
#include "stages/values/wavefront/models.h"
#include "stages/values/wavefront/step.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

class Encoder : Wave<true> {
 public:
  Encoder(const WaveBrick& brick, WaveSymbols& symbols, RowReader reader, RowWriter writer)
      : Wave(brick, symbols.buffers, reader, writer, nullptr),
        low_bits_(symbols.low_bits),
        bits_(symbols.bits) {}

  void run() {
    BitWriter bits(bits_);
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
        if (t < 32 ? (t & (t + 1)) == 0 : t % 8 == 7) biases_.learn();
      }
      // All rows of the period before have ended.
      if (group > 0) code_steps((group - 1) * s.period, group * s.period, bits);
      if (end == last + 1) code_steps(group * s.period, end, bits);
      finish_period(group);
    }
    for (std::int64_t group = (last / s.period) + 1; group < s.all_groups + 2; ++group) finish_period(group);
    bits.finish();
  }

 private:
  void code_steps(std::int64_t from, std::int64_t to, BitWriter& bits) {
    const Schedule& s = s_;
    WaveBuffers& b = buffers_;
    std::int16_t* const tables = b.tables;
    const std::int64_t ring = 2 * s.period + 1;
    std::int64_t now = from % ring;
    // Of both halves, since the odd slices follow later.
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
          store(if_else(in, load16(c.texture), set16(idle_texture * static_cast<int>(symbol_count))),
                c.texture);
          store(if_else(in, load16(c.level),
                        set16((brick_.one_distribution ? idle_texture : idle_level) *
                              static_cast<int>(symbol_count))),
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

  LowBitsOfSteps& low_bits_;
  std::vector<std::uint8_t>& bits_;
};

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
