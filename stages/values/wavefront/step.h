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
  const Contexts contexts = contexts_of(f, n, around, bound);
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

/// The place of the prediction among the values around, seen from their middle: by how many thirds of a step it is
/// outside of them or, with the bound 0, whether it is, and what rounding took from it. Residuals lead back to the
/// middle more often than away from it, so those of predictions below it are coded with the other sign.
template <bool encoding>
TAGRID_STEP I32 Wave<encoding>::place_of(Half& f, I32 above_top, I32 below_bottom, const StepBound& bound,
                                         M32 flat) const {
  const I32 zero = set32(0), outside = max(above_top, below_bottom), fraction = f.predicted.fraction;
  // As the step is odd, no quotient is halfway.
  const I32 thirds = nearest(to_float(outside) * (bound.reciprocal * set_float(3)));
  I32 place = min(max(thirds + set32(4), zero), set32(7)), from_middle = above_top - below_bottom;
  const M32 exact = bound.error == zero;
  if (any_exact_) from_middle = if_else(exact, shift_left<10>(from_middle) + fraction, from_middle);
  f.predicted.flip = except(is_negative(from_middle), flat);
  if (any_exact_) {
    const I32 rest = if_else(f.predicted.flip, negative(fraction), fraction);
    const I32 quarter = min(shift_right<9>(rest + set32(1024)), set32(3));
    place = if_else(exact, quarter + if_or_zero(outside > zero, set32(4)), place);
  }
  return place;
}

template <bool encoding>
TAGRID_STEP Contexts Wave<encoding>::contexts_of(Half& f, const Neighbours& n, I16 around,
                                                 const StepBound& bound) const {
  const M32 flat = widen(n.flat);
  const I32 energy = float_of_twice(widen_unsigned(around + shift_left<2>(f.last.size) + f.last.size2));
  const I32 coarse = min(max(shift_right<22>(energy) - set32(256), set32(0)), set32(15));
  Contexts c;
  c.low_bits = zero_or(flat, max(shift_right<23>(energy) - set32(127 + 6), set32(0)));
  const I32 top = widen(max(n.largest, n.left)), bottom = widen(min(n.smallest, n.left)),
            spread = top - bottom;
  // floor(4 * spread / step): as the step is odd, no quotient is halfway.
  const I32 steps = nearest(to_float(shift_left<2>(spread) - bound.error) * bound.reciprocal);
  const I32 unlike = min(max(shift_right<23>(float_of_twice(steps)) - set32(128), set32(0)), set32(7));
  const I32 place = place_of(f, f.predicted.value - top, bottom - f.predicted.value, bound, flat);
  const I32 sign = if_else(f.predicted.flip, set32(2) - f.last.sign, f.last.sign);
  const I32 level = shift_right<17>((f.predicted.value - low_) * level_scale_);
  const I32 texture =
      shift_left<6>(coarse) + shift_left<3>(unlike) + shift_left<1>(sign) + shift_right<2>(place);
  c.texture = shift_left<4>(if_else(flat, set32(flat_texture), texture));
  const I32 of_level = shift_left<3>(shift_left<2>(level) + shift_right<2>(coarse)) + place;
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
  const I32 turned = if_else(f.predicted.flip, negative(residual), residual);
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
