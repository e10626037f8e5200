// The lanes of both halves of a brick, step by step; the same for encoding and decoding. Included once for
// each instruction set.
#if defined(TAGRID_STAGES_WAVEFRONT_WAVE) == defined(HWY_TARGET_TOGGLE)
#ifdef TAGRID_STAGES_WAVEFRONT_WAVE
#undef TAGRID_STAGES_WAVEFRONT_WAVE
#else
#define TAGRID_STAGES_WAVEFRONT_WAVE
#endif

#include <bit>
#include <cassert>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "stages/wavefront/bits.h"
#include "stages/wavefront/buffers.h"
#include "stages/wavefront/coder.h"
#include "stages/wavefront/contexts.h"
#include "stages/wavefront/schedule.h"
#include "stages/wavefront/vectors.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

// ---- Rows and lanes

/// From the rows of a group in `strip` to what lanes code, by step.
inline void rows_to_lanes(const Strip& strip, const Schedule& s, std::int16_t (*line)[wave_lanes]) {
  const std::int64_t end = s.size.x + wave_margin + wave_slope;
  for (std::int64_t t = 0; t < end; t += 8)
    for (int q = 0; q < wave_lanes; q += 8) {
      Eight v[8];
      TAGRID_UNROLL
      for (int i = 0; i < 8; ++i) v[i] = load8(strip.row(q + i) + t - wave_skew * (q + i) - wave_margin);
      transpose(v);
      TAGRID_UNROLL
      for (int i = 0; i < 8; ++i) {
        std::int16_t* to = line[t + i] + q;
        // Lanes that have not begun are still in the group before.
        if (t < wave_slope) v[i] = if_else(load8(begun_lanes.of_phase[t + i] + q), v[i], load8(to));
        store(v[i], to);
      }
    }
}

inline void lanes_to_rows(const Line* line, const Schedule& s, const Strip& strip) {
  const std::int64_t end = s.size.x + wave_margin + wave_slope;
  for (std::int64_t t = 0; t < end; t += 8)
    for (int q = 0; q < wave_lanes; q += 8) {
      Eight v[8];
      TAGRID_UNROLL
      for (int i = 0; i < 8; ++i) v[i] = load8(line[t + i].value + first_lane + q);
      transpose(v);
      TAGRID_UNROLL
      for (int i = 0; i < 8; ++i) store(v[i], strip.row(q + i) + t - wave_skew * (q + i) - wave_margin);
    }
}

// ---- Prediction

/// What a step knows when its residuals are known, beside these.
struct Half {
  Line *lines, *before, *next;  ///< own; those of the slice before, and of the one after, at the same index
  std::int16_t (*originals)[wave_lanes];
  std::uint16_t* surface;        ///< active points
  I16 left, left2, size, size2;  ///< values and residuals of the steps before
  I32 sign;                      ///< of the residual on the left, plus 1
  I32 constant;                  ///< of the weights
  I32 prediction, fraction, bias_index, usual, residual, step, largest;
  M32 active, flip;
  I16 above, above2;  ///< values of the row above, and two voxels further
  I32 state;
  I32 low_bits;
  Coded* record;                 ///< encoding: where the step is kept for the coder of symbols
  std::uint32_t coded, any_low;  ///< lanes with a symbol, lanes with bits without a model
  std::uint32_t fresh, absent;   ///< lanes that begin a row, lanes without a row
  bool slow;
  std::int64_t phase = 0, group = -1, of_slice = -1;
  std::uint16_t rows = 0, rows_before = 0, quiet = 0, quiet_before = 0;  ///< of this group and the one before
  alignas(64) std::int16_t weights[9][32];
  alignas(64) std::int16_t texture[wave_lanes], level[wave_lanes];
  alignas(64) std::int32_t interval[wave_lanes] = {}, symbol[wave_lanes] = {};
};

inline constexpr int bias_count = 192;
inline constexpr int bias_window = 64;  ///< voxels after which a bias forgets
inline constexpr int error_limit = 1 << 22;

struct Bound {
  I32 error, step, step256, usual_cap, largest;
  F32 reciprocal;
};

template <bool encoding>
class Wave {
 public:
  Wave(const WaveBrick& brick, WaveBuffers& buffers, RowReader reader, RowWriter writer, const RowSet* quiet)
      : brick_(brick),
        s_(buffers.schedule),
        buffers_(buffers),
        reader_(reader),
        writer_(writer),
        given_quiet_(quiet),
        two_bounds_(brick.activity != nullptr) {
    const VoxelParameters& p = brick.parameters;
    low_ = set32(p.low);
    std::int32_t no_bias[wave_lanes];
    for (int i = 0; i < wave_lanes; ++i) no_bias[i] = bias_count + i;
    no_bias_ = load32(no_bias);
    high_ = set32(p.high);
    level_scale_ = set32(static_cast<std::int32_t>((std::uint64_t{64} << 16) /
                                                   static_cast<std::uint64_t>(p.high - p.low + 1)));
    for (int b = 0; b < 2; ++b) {
      const std::int64_t error =
                             std::clamp<std::int64_t>(brick.errors[static_cast<std::size_t>(b)], 0, 65535),
                         step = 2 * error + 1;
      const std::int64_t step256 = std::min<std::int64_t>(step * 256, error_limit);
      bounds_[b] = {set32(static_cast<std::int32_t>(error)),
                    set32(static_cast<std::int32_t>(step)),
                    set32(static_cast<std::int32_t>(step256)),
                    set32(static_cast<std::int32_t>(error_limit / step256 + 1)),
                    set32(static_cast<std::int32_t>((p.high - p.low) / step + 1)),
                    set_float(1.0f / static_cast<float>(step))};
      fine_lanes_[b] = error < 2 ? 0xffff : 0;
    }
    any_fine_ = (fine_lanes_[0] | (two_bounds_ ? fine_lanes_[1] : 0)) != 0;
    least_error_ =
        set16(static_cast<int>(std::min<std::int64_t>(std::min(brick.errors[0], brick.errors[1]), 32767)));
    std::memset(bias_value_, 0, sizeof bias_value_);
    std::memset(bias_seen_, 0, sizeof bias_seen_);
    std::memset(bias_sum_, 0, sizeof bias_sum_);
    level_tables_ = buffers.tables + (brick.one_distribution ? 0 : level_offset);
    std::memcpy(buffers.tables, initial_distributions().data(), distribution_elements * 2);
    for (int h = 0; h < 2; ++h) {
      Half& f = half_[h];
      f.lines = buffers.lines[h];
      f.originals = buffers.originals[h];
      f.surface = buffers.surface[h];
      f.constant = set32(0);
      for (int i = 0; i < wave_lanes; ++i) set_weights(f, i, h);
      f.left = f.left2 = set16(p.reference);
      f.size = f.size2 = set16(0);
      f.sign = set32(1);
    }
    link();
  }

 protected:
  void link() {
    half_[0].before = half_[1].lines - s_.slice;
    half_[0].next = half_[1].lines;
    half_[1].before = half_[0].lines;
    half_[1].next = half_[0].lines + s_.slice;
  }

  /// The weights of lane i in slice z.
  void set_weights(Half& f, int i, std::int64_t z) {
    static constexpr int pair[9][2] = {{2, 3},   {4, 6},   {7, 8},  {9, 10}, {11, 12},
                                       {13, 14}, {15, 16}, {17, 5}, {0, 1}};
    Weights w = z == 0 ? brick_.parameters.first_slice : brick_.parameters.others;
    if (z == 0)
      for (std::size_t t = slice_taps; t < taps.size(); ++t) w.of_tap[t] = 0;
    // Two slices before the second one lies the first one again.
    if (z == 1) {
      w.of_tap[8] += w.of_tap[17];
      w.of_tap[17] = 0;
    }
    alignas(64) std::int32_t constant[wave_lanes];
    store(f.constant, constant);
    constant[i] = brick_.parameters.reference * (2048 - w.sum());
    f.constant = load32(constant);
    const int at = (i & 4) * 4 + 2 * ((i & 3) + (i >> 3) * 4);
    for (int j = 0; j < 9; ++j) {
      f.weights[j][at] = static_cast<std::int16_t>(w.of_tap[static_cast<std::size_t>(pair[j][0])]);
      f.weights[j][at + 1] = static_cast<std::int16_t>(w.of_tap[static_cast<std::size_t>(pair[j][1])]);
    }
  }

  /// The second distributions, or null if the first ones stand for them.
  std::int16_t* learning_levels() const { return brick_.one_distribution ? nullptr : level_tables_; }

  std::uint32_t mixed(std::uint32_t now, std::uint32_t before, std::uint32_t begun) const {
    return (now & begun) | (before & ~begun);
  }

  void begin_group(Half& f, int h) {
    ++f.group;
    if (++f.of_slice == s_.groups) f.of_slice = 0;
    f.rows_before = f.rows;
    f.rows = static_cast<std::uint16_t>((1u << s_.rows_of(h, f.group)) - 1);
    if constexpr (!encoding) {
      f.quiet_before = f.quiet;
      f.quiet = f.group < s_.all_groups
                    ? (*given_quiet_)[static_cast<std::size_t>(h)][static_cast<std::size_t>(f.group)]
                    : 0;
    }
  }

  /// Copies the rows of line t that neighbours in other groups and slices ask for.
  TAGRID_STEP void copy_borders(Half& f, std::int64_t t) {
    Line* const l = f.lines + t;
    const std::int64_t up = s_.period - wave_slope, of_slice = f.of_slice;
    const bool last = of_slice == s_.groups - 1;
    // Lanes 14 and 15 may still be in the group before.
    const bool last14 = f.phase >= 42 ? last : of_slice == 0, last15 = f.phase >= 45 ? last : of_slice == 0;
    if (!last14) {
      l[up].value[first_lane - 2] = l->value[first_lane + 14];
      l[up].size[first_lane - 2] = l->size[first_lane + 14];
    }
    if (!last15) {
      l[up].value[first_lane - 1] = l->value[first_lane + 15];
      l[up].size[first_lane - 1] = l->size[first_lane + 15];
    } else {
      l[3].value[first_lane + 16] = l->value[first_lane + 15];
      l[3].size[first_lane + 16] = 0;
    }
    if (of_slice > 0) {
      l[-up].value[first_lane + 16] = l->value[first_lane];
      l[-up].size[first_lane + 16] = l->size[first_lane];
    } else {
      Line* const n = f.next + t;
      n[-3].value[first_lane - 1] = n[-6].value[first_lane - 2] = l->value[first_lane];
      n[-3].size[first_lane - 1] = n[-6].size[first_lane - 2] = l->size[first_lane];
    }
  }

  /// Before the steps of a period.
  void begin_period(std::int64_t period) {
    const std::int64_t t = period * s_.period;
    if (t + buffers_.ahead > buffers_.first_line + buffers_.capacity) slide(t);
    if (period >= s_.all_groups) return;
    for (int h = 0; h < 2; ++h) {
      if constexpr (encoding) fill(half_[h], h, period);
      if (two_bounds_) mark(half_[h], h, period);
    }
  }
  /// After the steps of a period: rows have ended that began in the one before, or in the odd slices two
  /// before.
  void finish_period(std::int64_t period) {
    for (int h = 0; h < 2; ++h) {
      const std::int64_t group = period - 1 - h, rows = s_.rows_of(h, group);
      const std::int64_t z = s_.z_of(h, group), y = s_.y_of(group);
      if (rows == 0 || z >= writer_.slices) continue;
      const Strip& strip = buffers_.strip;
      lanes_to_rows(half_[h].lines + group * s_.period, s_, strip);
      for (std::int64_t i = 0; i < rows; ++i)
        writer_.write(writer_.samples, (z * s_.size.y + y + i) * s_.size.x, s_.size.x, strip.row(i));
    }
  }
  void fill(Half& f, int h, std::int64_t group) {
    const std::int64_t z = s_.z_of(h, group), y = s_.y_of(group), rows = s_.rows_of(h, group);
    const Strip& strip = buffers_.strip;
    for (std::int64_t i = 0; i < rows; ++i)
      reader_.read(reader_.samples, (z * s_.size.y + y + i) * s_.size.x, s_.size.x, strip.row(i));
    if (rows > 0) rows_to_lanes(strip, s_, f.originals + group * s_.period);
  }
  void mark(Half& f, int h, std::int64_t group) {
    const std::int64_t z = s_.z_of(h, group), y = s_.y_of(group), rows = s_.rows_of(h, group),
                       from = group * s_.period;
    std::fill_n(f.surface + from + wave_slope, s_.period, std::uint16_t{0});
    const std::int64_t before = brick_.origin.x - brick_.activity->box().low.x;
    for (std::int64_t i = 0; i < rows; ++i) {
      const std::uint64_t* const row = brick_.activity->row(brick_.origin.y + y + i, brick_.origin.z + z);
      std::uint16_t* const to = f.surface + from + wave_skew * i + wave_margin;
      for (std::int64_t x = 0; x < s_.size.x; ++x) {
        const auto bit = static_cast<std::uint64_t>(before + x);
        to[x] = static_cast<std::uint16_t>(to[x] | (row[bit / 64] >> (bit % 64) & 1) << i);
      }
    }
  }
  /// Drops the lines that nothing asks for any more.
  void slide(std::int64_t t) {
    const std::int64_t dropped = t - buffers_.reach - buffers_.first_line, kept = buffers_.capacity - dropped;
    const auto move = [&](auto*& lines) {
      auto* const first = lines + buffers_.first_line;
      std::memmove(static_cast<void*>(first), static_cast<const void*>(first + dropped),
                   static_cast<std::size_t>(kept) * sizeof *first);
      lines -= dropped;
    };
    for (int h = 0; h < 2; ++h) {
      move(half_[h].lines);
      if constexpr (encoding) move(half_[h].originals);
      if (two_bounds_) move(half_[h].surface);
    }
    buffers_.first_line += dropped;
    link();
  }

  static TAGRID_LANE I16 values(const Line* l, std::int64_t step, int lane) {
    return load16(l[step].value + first_lane + lane);
  }
  static TAGRID_LANE I16 sizes(const Line* l, std::int64_t step, int lane) {
    return load16(l[step].size + first_lane + lane);
  }

  TAGRID_LANE I32 by_bound(const I32& of_inactive, const I32& of_active, M32 surface) const {
    return two_bounds_ ? if_else(surface, of_active, of_inactive) : of_inactive;
  }

  /// From the neighbours of line t to the contexts; encoding, to the residuals.
  TAGRID_STEP void front(Half& f, int h, std::int64_t t);
  /// From the residuals to the values, and what they teach.
  TAGRID_STEP void back(Half& f, std::int64_t t);
  void learn_biases();

  const WaveBrick& brick_;
  const Schedule& s_;
  WaveBuffers& buffers_;
  RowReader reader_;
  RowWriter writer_;
  const RowSet* given_quiet_;
  const bool two_bounds_;
  Half half_[2];
  I32 low_, high_, level_scale_, no_bias_;
  Bound bounds_[2];
  bool any_fine_;
  std::uint32_t fine_lanes_[2];  ///< all or none, by bound
  std::int16_t* level_tables_;   ///< the second distribution of a symbol
  I16 least_error_;
  alignas(64) std::int32_t bias_value_[bias_count], bias_seen_[bias_count];
  /// How many errors, and their sum.
  alignas(64) std::int32_t bias_sum_[bias_count + 16][2];
};

/// The exponent of 2 * number + 1 in half octaves, or in octaves.
TAGRID_LANE I32 float_of_twice(I32 number) { return bits_of(to_float(number + number + set32(1))); }

template <bool encoding>
TAGRID_STEP void Wave<encoding>::front(Half& f, int h, std::int64_t t) {
  if (t > 0) copy_borders(f, t - 1);
  if (t == 0 || ++f.phase == s_.period) {
    f.phase = 0;
    begin_group(f, h);
  }
  const std::uint32_t begun = f.phase < wave_slope ? begun_bits(f.phase) : 0xffff;
  const std::uint32_t rows = mixed(f.rows, f.rows_before, begun);
  const std::uint32_t active = buffers_.voxel_lanes[f.phase] & rows;
  std::uint32_t fresh = 0;
  if (f.phase < wave_slope && f.phase % wave_skew == 0) {
    const int lane = static_cast<int>(f.phase / wave_skew);
    fresh = 1u << lane;
    if (f.group == s_.groups) set_weights(f, lane, 2 + h);
  }
  f.fresh = fresh;
  f.absent = rows ^ 0xffff;

  Line* const L = f.lines + t;
  const Line* const B = f.before + t;
  const I16 left = f.left, n0 = values(L, -3, -1), nm1 = values(L, -4, -1), np1 = values(L, -2, -1);
  // This is of the step before: a load would have to wait for its store.
  const I16 np2 = next_lane(left, L[-1].value[first_lane - 1]);
  f.above = n0;
  f.above2 = np2;
  const I16 raw0 = values(B, 0, 0), raw1 = values(B, 1, 0), raw_below = values(B, 3, 1);
  I16 b0 = raw0, bp1 = raw1, below = raw_below;
  if (h == 0 && f.group <= s_.groups) {  // lanes in the first slice
    const M16 first = mask16(f.group < s_.groups ? 0xffff : ~begun);
    b0 = if_else(first, n0, b0);
    bp1 = if_else(first, n0, bp1);
    below = if_else(first, n0, below);
  }
  const I16 largest = max(max(max(nm1, n0), np1), max(max(b0, bp1), below));
  const I16 smallest = min(min(min(nm1, n0), np1), min(min(b0, bp1), below));
  const M16 flat = (largest == left) & (smallest == left);
  const std::uint32_t flat_lanes = bits(flat);
  I16 original = left;
  if constexpr (encoding) {  // all flat, and within the bound of the value on the left?
    original = load16(f.originals[t]);
    const M16 same = flat & not_above(max(original, left) - min(original, left), least_error_);
    f.slow = (active & ~bits(same)) != 0;
  } else {
    f.slow = (active & ~(flat_lanes & mixed(f.quiet, f.quiet_before, begun))) != 0;
  }
  if (!f.slow) {
    if constexpr (encoding) {
      Coded& c = *f.record;
      c.lanes = static_cast<std::uint16_t>(active);
      c.extra = 0;
      if (active != 0) {
        store(set16(flat_texture * static_cast<int>(symbol_count)), c.texture);
        store(set16((brick_.one_distribution ? flat_texture : flat_level) * static_cast<int>(symbol_count)),
              c.level);
        store(set16(7), c.symbol);
      }
    }
    return;
  }

  // The weighted sum; what the step before gives comes last.
  PairSums s = no_sums(), s2 = no_sums();
  add_products(n0, nm1, f.weights[0], s);
  add_products(np1, values(L, -5, -1), f.weights[1], s2);
  add_products(values(L, -6, -2), raw0, f.weights[2], s);
  add_products(values(B, -1, 0), raw1, f.weights[3], s2);
  add_products(values(B, -3, -1), raw_below, f.weights[4], s);
  add_products(values(B, -4, -1), values(B, -2, -1), f.weights[5], s2);
  add_products(values(B, 2, 1), values(B, 4, 1), f.weights[6], s);
  add_products(values(L, -s_.slice, 0), np2, f.weights[7], s2);
  add_products(left, f.left2, f.weights[8], s);
  const I32 exact = total(s, s2) + f.constant;

  // Residuals around, and the context of the bias
  const I16 three = set16(3);
  const I16 row_above = sizes(L, -3, -1) * three + sizes(L, -4, -1) + sizes(L, -2, -1);
  I16 slice_before = sizes(B, 0, 0) * three + sizes(B, 1, 0) + sizes(B, 3, 1);
  if (h == 0 && f.group <= s_.groups)
    slice_before = if_else(mask16(f.group < s_.groups ? 0xffff : ~begun), row_above, slice_before);
  const I16 around16 = row_above + slice_before + sizes(L, -6, -2);
  const I32 around = widen_unsigned(around16), one = set32(1);
  const I32 octave = min(shift_right<23>(float_of_twice(around)) - set32(127), set32(15));
  const I32 plain = shift_right<11>(exact), left32 = widen(left);
  I32 bias = shift_right<1>(octave) * set32(24) + shift_left<3>(f.sign);
  bias = bias + if_or_zero(widen(n0) > plain, one) + if_or_zero(left32 > plain, set32(2)) +
         if_or_zero(widen(b0) > plain, set32(4));
  const I32 corrected = exact + gather(bias_value_, bias);
  const I32 rounded = shift_right<11>(corrected + set32(1024));
  const M32 flat32 = widen(flat);
  f.fraction = corrected - shift_left<11>(rounded);
  f.prediction = if_else(flat32, left32, min(max(rounded, low_), high_));

  // Contexts of the symbol
  M32 surface = mask32(0);
  if (two_bounds_) surface = mask32(f.surface[t]);
  f.step = by_bound(bounds_[0].step, bounds_[1].step, surface);
  const I32 error = by_bound(bounds_[0].error, bounds_[1].error, surface);
  F32 reciprocal = bounds_[0].reciprocal;
  if (two_bounds_) reciprocal = if_else(surface, bounds_[1].reciprocal, reciprocal);
  const I32 energy = float_of_twice(widen_unsigned(around16 + shift_left<2>(f.size) + f.size2));
  const I32 coarse = min(max(shift_right<22>(energy) - set32(256), set32(0)), set32(15));
  const I32 low_bits = zero_or(flat32, max(shift_right<23>(energy) - set32(127 + 6), set32(0)));
  const I32 spread = widen_unsigned(max(largest, left) - min(smallest, left));
  // floor(4 * spread / step): as the step is odd, no quotient is halfway.
  const I32 steps = nearest(to_float(shift_left<2>(spread) - error) * reciprocal);
  const I32 unlike = min(max(shift_right<22>(float_of_twice(steps)) - set32(256), set32(0)), set32(15));
  I32 sign = f.sign, rest = set32(0);
  if (any_fine_) {  // if the step is small, the direction in which the prediction was rounded matters
    M32 turn = except(is_negative(f.fraction), flat32);
    rest = min(shift_right<8>(absolute(f.fraction)), set32(3));
    if (two_bounds_) {
      const M32 is_fine =
          mask32((fine_lanes_[0] & ~std::uint32_t{f.surface[t]}) | (fine_lanes_[1] & f.surface[t]));
      turn = turn & is_fine;
      rest = if_or_zero(is_fine, rest);
    }
    f.flip = turn;
    sign = if_else(turn, set32(2) - sign, sign);
  }
  const I32 level = shift_right<16>((f.prediction - low_) * level_scale_);
  I32 texture = (shift_left<4>(coarse) + unlike) * set32(3) + sign;
  texture = shift_left<4>(if_else(flat32, set32(flat_texture), texture));
  I32 of_level = shift_left<2>(shift_left<2>(level) + shift_right<2>(coarse)) + rest;
  of_level = brick_.one_distribution ? texture : shift_left<4>(if_else(flat32, set32(flat_level), of_level));
  // Lanes without a bias add to entries of their own, so that they do not wait for each other.
  f.bias_index = if_else(mask32(active & ~flat_lanes), bias, no_bias_);
  // So 256 errors, those of eight steps, fit into 32 bits.
  f.usual = min(min(around + set32(8), by_bound(bounds_[0].usual_cap, bounds_[1].usual_cap, surface)) *
                    by_bound(bounds_[0].step256, bounds_[1].step256, surface),
                set32(2 * error_limit - 1));
  f.active = mask32(active);

  if constexpr (encoding) {
    // The nearest multiple of the step; as the step is odd, no difference is halfway.
    const I32 residual = if_or_zero(f.active, nearest(to_float(widen(original) - f.prediction) * reciprocal));
    f.residual = residual;
    const std::uint32_t loud = bits(residual == set32(0)) ^ 0xffff;
    auto* const quiet = buffers_.quiet[h].data() + f.group;
    quiet[0] &= static_cast<std::uint16_t>(~(loud & begun));
    if (f.group > 0) quiet[-1] &= static_cast<std::uint16_t>(~(loud & ~begun));
    const I32 turned = any_fine_ ? if_else(f.flip, negative(residual), residual) : residual;
    const M32 has_low = low_bits > set32(0);
    const std::uint32_t low_lanes = bits(has_low) & active;
    const I32 high = low_lanes != 0 ? shift_right(turned, low_bits) : turned;
    I32 symbol = high + set32(7);
    const M32 far = except(mask32(active), (set32(15) > symbol) & (symbol >= set32(0)));
    symbol = if_else(far, set32(15), symbol);
    Coded& c = *f.record;
    c.lanes = static_cast<std::uint16_t>(active);
    c.far = static_cast<std::uint16_t>(bits(far));
    c.low = static_cast<std::uint16_t>(low_lanes);
    c.extra = c.far | c.low;
    store(narrow(texture), c.texture);
    store(narrow(of_level), c.level);
    store(narrow(symbol), c.symbol);
    if (c.extra != 0) {
      store(turned, c.turned);
      store(narrow(low_bits), c.low_bits);
    }
  } else {
    const std::uint32_t coded = active & ~mixed(f.quiet, f.quiet_before, begun);
    f.coded = coded;
    f.largest = by_bound(bounds_[0].largest, bounds_[1].largest, surface);
    const M32 m = mask32(coded);
    store(narrow(if_else(m, texture, set32(idle_texture * static_cast<int>(symbol_count)))), f.texture);
    store(narrow(if_else(
              m, of_level,
              set32((brick_.one_distribution ? idle_texture : idle_level) * static_cast<int>(symbol_count)))),
          f.level);
    f.any_low = bits(low_bits > set32(0)) & coded;
    f.low_bits = low_bits;
  }
}

template <bool encoding>
TAGRID_STEP void Wave<encoding>::back(Half& f, std::int64_t t) {
  I16 value = f.left, size = set16(0);
  I32 sign = set32(1);
  if (f.slow) {
    const I32 residual = f.residual;
    const I32 decoded = min(max(f.prediction + residual * f.step, low_), high_);
    value = narrow(if_else(f.active, decoded, widen(value)));
    size = narrow(min(absolute(residual), set32(4095)));
    sign = min(max(residual, set32(-1)), set32(1)) + set32(1);
    // An edge says nothing about the bias elsewhere, so an error is limited to what is usual around it.
    I32 wrong = shift_left<11>(decoded - f.prediction) - f.fraction;
    wrong = max(min(wrong, f.usual), negative(f.usual));
    alignas(64) std::int32_t index[wave_lanes], error[wave_lanes];
    store(f.bias_index, index);
    store(wrong, error);
    TAGRID_UNROLL
    for (int i = 0; i < wave_lanes; ++i) {
      std::uint64_t sum;
      std::memcpy(&sum, bias_sum_[index[i]], 8);
      sum += (static_cast<std::uint64_t>(static_cast<std::int64_t>(error[i])) << 32) + 1;
      std::memcpy(bias_sum_[index[i]], &sum, 8);
    }
  }
  if (f.fresh != 0) value = if_else(mask16(f.fresh), f.above2, value);
  if (f.absent != 0) value = if_else(mask16(f.absent), f.above, value);
  Line* const L = f.lines + t;
  store(value, L->value + first_lane);
  store(size, L->size + first_lane);
  f.left2 = f.left;
  f.left = value;
  f.size2 = f.size;
  f.size = size;
  f.sign = sign;
}

template <bool encoding>
void Wave<encoding>::learn_biases() {
  for (int c = 0; c < bias_count; c += wave_lanes) {
    std::uint64_t sums[wave_lanes], any = 0;
    std::memcpy(sums, bias_sum_[c], sizeof sums);
    for (const std::uint64_t s : sums) any |= s;
    if (any == 0) continue;
    alignas(64) std::int32_t count[wave_lanes], sum[wave_lanes];
    for (int i = 0; i < wave_lanes; ++i) {
      count[i] = bias_sum_[c + i][0];
      sum[i] = bias_sum_[c + i][1];
    }
    const I32 n = load32(count) + load32(bias_seen_ + c);
    const I32 step = truncated(to_float(load32(sum)) / (to_float(n) + set_float(0.5f)));
    store(max(min(load32(bias_value_ + c) + step, set32(1 << 27)), set32(-(1 << 27))), bias_value_ + c);
    store(min(n, set32(bias_window)), bias_seen_ + c);
    std::memset(bias_sum_[c], 0, sizeof bias_sum_[c] * wave_lanes);
  }
}

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
