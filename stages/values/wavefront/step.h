// A step of the lanes: what is known around its voxels, what this predicts, and in which contexts the
// residuals are coded.
#pragma once

#include <cstdint>

#include "stages/values/wavefront/contexts.h"
#include "stages/values/wavefront/predict.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

/// From the neighbors of line t to the contexts; encoding, to the residuals.
template <bool encoding>
TAGRID_STEP void Wave<encoding>::front(Half& f, int h, std::int64_t t) {
  const StepLanes lanes = begin_step(f, h, t);
  const Neighbours n = neighbours_of(f, t, lanes);
  f.predicted.slow = !repeats(f, n, lanes);
  if (!f.predicted.slow) {
    if constexpr (encoding) record_flat(f, lanes);
    return;
  }
  const I32 exact = weighted_sum(f, t, n);
  const I16 around = residuals_around(f, t, lanes);
  predict(f, n, exact, around, lanes);
  const StepBound bound = bound_of(f, t);
  const Contexts contexts = contexts_of(f, t, n, around, bound);
  if constexpr (encoding)
    quantize(f, n, bound, contexts, lanes);
  else
    keep(f, bound, contexts, lanes);
}

template <bool encoding>
TAGRID_STEP StepBound Wave<encoding>::bound_of(Half& f, std::int64_t t) const {
  StepBound bound;
  bound.surface = mask32(0);
  if (two_bounds_) bound.surface = mask32(f.surface[t]);
  f.predicted.step = by_bound(bounds_[0].step, bounds_[1].step, bound.surface);
  bound.error = by_bound(bounds_[0].error, bounds_[1].error, bound.surface);
  bound.reciprocal = bounds_[0].reciprocal;
  if (two_bounds_) bound.reciprocal = if_else(bound.surface, bounds_[1].reciprocal, bound.reciprocal);
  return bound;
}

/// If the step is small, the direction in which the prediction was rounded matters: residuals are coded as if
/// it was always the same. Returns what is left of the prediction, in quarters of a half.
template <bool encoding>
TAGRID_STEP I32 Wave<encoding>::flip_if_fine(Half& f, std::int64_t t, const M32& flat) const {
  M32 turn = except(is_negative(f.predicted.fraction), flat);
  I32 rest = min(shift_right<8>(absolute(f.predicted.fraction)), set32(3));
  if (two_bounds_) {
    const M32 is_fine =
        mask32((fine_lanes_[0] & ~std::uint32_t{f.surface[t]}) | (fine_lanes_[1] & f.surface[t]));
    turn = turn & is_fine;
    rest = if_or_zero(is_fine, rest);
  }
  f.predicted.flip = turn;
  return rest;
}

template <bool encoding>
TAGRID_STEP Contexts Wave<encoding>::contexts_of(Half& f, std::int64_t t, const Neighbours& n, I16 around,
                                                 const StepBound& bound) const {
  const M32 flat = widen(n.flat);
  const I32 energy = float_of_twice(widen_unsigned(around + shift_left<2>(f.last.size) + f.last.size2));
  const I32 coarse = min(max(shift_right<22>(energy) - set32(256), set32(0)), set32(15));
  Contexts c;
  c.low_bits = zero_or(flat, max(shift_right<23>(energy) - set32(127 + 6), set32(0)));
  const I32 spread = widen_unsigned(max(n.largest, n.left) - min(n.smallest, n.left));
  // floor(4 * spread / step): as the step is odd, no quotient is halfway.
  const I32 steps = nearest(to_float(shift_left<2>(spread) - bound.error) * bound.reciprocal);
  const I32 unlike = min(max(shift_right<22>(float_of_twice(steps)) - set32(256), set32(0)), set32(15));
  I32 sign = f.last.sign, rest = set32(0);
  if (any_fine_) {
    rest = flip_if_fine(f, t, flat);
    sign = if_else(f.predicted.flip, set32(2) - sign, sign);
  }
  const I32 level = shift_right<16>((f.predicted.value - low_) * level_scale_);
  const I32 texture = (shift_left<4>(coarse) + unlike) * set32(3) + sign;
  c.texture = shift_left<4>(if_else(flat, set32(flat_texture), texture));
  const I32 of_level = shift_left<2>(shift_left<2>(level) + shift_right<2>(coarse)) + rest;
  c.level = brick_.one_distribution ? c.texture : shift_left<4>(if_else(flat, set32(flat_level), of_level));
  // So 256 errors, those of eight steps, fit into 32 bits.
  f.predicted.usual = min(min(widen_unsigned(around) + set32(8),
                              by_bound(bounds_[0].usual_cap, bounds_[1].usual_cap, bound.surface)) *
                              by_bound(bounds_[0].step256, bounds_[1].step256, bound.surface),
                          set32(2 * error_limit - 1));
  return c;
}

/// Encoding: the residuals, and what the coder of symbols needs.
template <bool encoding>
TAGRID_STEP void Wave<encoding>::quantize(Half& f, const Neighbours& n, const StepBound& bound,
                                          const Contexts& contexts, const StepLanes& lanes) {
  // The nearest multiple of the step; as the step is odd, no difference is halfway.
  const I32 difference = widen(n.original) - f.predicted.value;
  const I32 residual = if_or_zero(f.predicted.active, nearest(to_float(difference) * bound.reciprocal));
  f.residual = residual;
  const std::uint32_t loud = bits(residual == set32(0)) ^ 0xffff;
  auto* const quiet = buffers_.quiet[static_cast<std::size_t>(lanes.half)].data() + f.at.group;
  quiet[0] &= static_cast<std::uint16_t>(~(loud & lanes.begun));
  if (f.at.group > 0) quiet[-1] &= static_cast<std::uint16_t>(~(loud & ~lanes.begun));
  const I32 turned = any_fine_ ? if_else(f.predicted.flip, negative(residual), residual) : residual;
  const std::uint32_t low_lanes = bits(contexts.low_bits > set32(0)) & lanes.active;
  const I32 high = low_lanes != 0 ? shift_right(turned, contexts.low_bits) : turned;
  I32 symbol = high + set32(7);
  const M32 far = except(mask32(lanes.active), (set32(15) > symbol) & (symbol >= set32(0)));
  symbol = if_else(far, set32(15), symbol);
  Coded& c = *f.record;
  c.lanes = static_cast<std::uint16_t>(lanes.active);
  c.far = static_cast<std::uint16_t>(bits(far));
  c.low = static_cast<std::uint16_t>(low_lanes);
  c.extra = c.far | c.low;
  store(narrow(contexts.texture), c.texture);
  store(narrow(contexts.level), c.level);
  store(narrow(symbol), c.symbol);
  if (c.extra != 0) {
    store(turned, c.turned);
    store(narrow(contexts.low_bits), c.low_bits);
  }
}

/// Encoding: that all voxels of the step repeat the value on their left.
template <bool encoding>
TAGRID_STEP void Wave<encoding>::record_flat(Half& f, const StepLanes& lanes) {
  Coded& c = *f.record;
  c.lanes = static_cast<std::uint16_t>(lanes.active);
  c.extra = 0;
  if (lanes.active == 0) return;
  store(set16(flat_texture * static_cast<int>(symbol_count)), c.texture);
  store(set16((brick_.one_distribution ? flat_texture : flat_level) * static_cast<int>(symbol_count)),
        c.level);
  store(set16(7), c.symbol);
}

/// Decoding: what the decoder of symbols needs.
template <bool encoding>
TAGRID_STEP void Wave<encoding>::keep(Half& f, const StepBound& bound, const Contexts& contexts,
                                      const StepLanes& lanes) {
  Decoding& s = f.decoding;
  s.coded = lanes.active & ~mixed(f.at.quiet, f.at.quiet_before, lanes.begun);
  s.largest = by_bound(bounds_[0].largest, bounds_[1].largest, bound.surface);
  const M32 m = mask32(s.coded);
  store(narrow(if_else(m, contexts.texture, set32(idle_texture * static_cast<int>(symbol_count)))),
        s.texture);
  store(narrow(if_else(
            m, contexts.level,
            set32((brick_.one_distribution ? idle_texture : idle_level) * static_cast<int>(symbol_count)))),
        s.level);
  s.any_low = bits(contexts.low_bits > set32(0)) & s.coded;
  s.low_bits = contexts.low_bits;
}

/// From the residuals to the values, and what they teach.
template <bool encoding>
TAGRID_STEP void Wave<encoding>::back(Half& f, std::int64_t t) {
  const Predicted& p = f.predicted;
  I16 value = f.last.left, size = set16(0);
  I32 sign = set32(1);
  if (p.slow) {
    const I32 residual = f.residual;
    const I32 decoded = min(max(p.value + residual * p.step, low_), high_);
    value = narrow(if_else(p.active, decoded, widen(value)));
    size = narrow(min(absolute(residual), set32(4095)));
    sign = min(max(residual, set32(-1)), set32(1)) + set32(1);
    // An edge is no evidence of a bias elsewhere, so an error is limited to the usual size around it.
    const I32 wrong = shift_left<11>(decoded - p.value) - p.fraction;
    biases_.add(p.bias_index, max(min(wrong, p.usual), negative(p.usual)));
  }
  if (p.fresh != 0) value = if_else(mask16(p.fresh), p.above2, value);
  if (p.absent != 0) value = if_else(mask16(p.absent), p.above, value);
  Line* const L = f.lines + t;
  store(value, L->value + first_lane);
  store(size, L->size + first_lane);
  f.last.left2 = f.last.left;
  f.last.left = value;
  f.last.size2 = f.last.size;
  f.last.size = size;
  f.last.sign = sign;
}

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
