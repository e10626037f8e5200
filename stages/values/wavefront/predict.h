// What is known around the voxels of a step, and what this predicts.
#pragma once

#include <cstdint>

#include "stages/values/wavefront/wave.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

TAGRID_LANE I16 values(const Line* l, std::int64_t step, int lane) {
  return load16(l[step].value + first_lane + lane);
}
TAGRID_LANE I16 sizes(const Line* l, std::int64_t step, int lane) {
  return load16(l[step].size + first_lane + lane);
}

/// 2 * number + 1 as a float. From its bits follows the exponent in octaves, or in half octaves.
TAGRID_LANE I32 float_of_twice(I32 number) { return bits_of(to_float(number + number + set32(1))); }

template <bool encoding>
TAGRID_STEP StepLanes Wave<encoding>::begin_step(Half& f, int h, std::int64_t t) {
  if (t > 0) copy_borders(f, t - 1);
  Progress& at = f.at;
  if (t == 0 || ++at.phase == s_.period) {
    at.phase = 0;
    begin_group(f, h);
  }
  StepLanes lanes;
  lanes.half = h;
  lanes.begun = at.phase < wave_slope ? begun_bits(at.phase) : 0xffff;
  const std::uint32_t rows = mixed(at.rows, at.rows_before, lanes.begun);
  lanes.active = buffers_.voxel_lanes[at.phase] & rows;
  std::uint32_t fresh = 0;
  if (at.phase < wave_slope && at.phase % wave_skew == 0) {
    const int lane = static_cast<int>(at.phase / wave_skew);
    fresh = 1u << lane;
    if (at.group == s_.groups) set_weights(f, lane, 2 + h);
  }
  f.predicted.fresh = fresh;
  f.predicted.absent = rows ^ 0xffff;
  return lanes;
}

template <bool encoding>
TAGRID_STEP Neighbours Wave<encoding>::neighbours_of(Half& f, std::int64_t t, const StepLanes& lanes) const {
  const Line *const L = f.lines + t, *const B = f.before + t;
  // Each row is three steps behind the row above it. So the neighbor (dx, dy) is in entry dx + 3 dy, in the lane dy
  // further.
  Neighbours n;
  n.left = f.last.left;
  n.above = values(L, -3, -1);
  n.above_left = values(L, -4, -1);
  n.above_right = values(L, -2, -1);
  // This is of the step before: a load would have to wait for its store.
  n.above_right2 = next_lane(n.left, L[-1].value[first_lane - 1]);
  f.predicted.above = n.above;
  f.predicted.above2 = n.above_right2;
  n.stored_behind = values(B, 0, 0);
  n.stored_behind_right = values(B, 1, 0);
  n.stored_behind_below = values(B, 3, 1);
  n.behind = n.stored_behind;
  I16 behind_right = n.stored_behind_right, behind_below = n.stored_behind_below;
  if (is_in_first_slice(f, lanes)) {
    const M16 first = first_slice_lanes(f, lanes);
    n.behind = if_else(first, n.above, n.behind);
    behind_right = if_else(first, n.above, behind_right);
    behind_below = if_else(first, n.above, behind_below);
  }
  n.largest =
      max(max(max(n.above_left, n.above), n.above_right), max(max(n.behind, behind_right), behind_below));
  n.smallest =
      min(min(min(n.above_left, n.above), n.above_right), min(min(n.behind, behind_right), behind_below));
  n.flat = (n.largest == n.left) & (n.smallest == n.left);
  n.flat_lanes = bits(n.flat);
  if constexpr (encoding) n.original = load16(f.originals[t]);
  return n;
}

/// Whether all voxels have neighbors that are equal, and the value of these.
template <bool encoding>
TAGRID_STEP bool Wave<encoding>::repeats(const Half& f, const Neighbours& n, const StepLanes& lanes) const {
  if constexpr (encoding) {
    const M16 same = n.flat & not_above(max(n.original, n.left) - min(n.original, n.left), least_error_);
    return (lanes.active & ~bits(same)) == 0;
  } else {
    return (lanes.active & ~(n.flat_lanes & mixed(f.at.quiet, f.at.quiet_before, lanes.begun))) == 0;
  }
}

/// The prediction in 2^-11, without its bias. What the step before gives comes last.
template <bool encoding>
TAGRID_STEP I32 Wave<encoding>::weighted_sum(const Half& f, std::int64_t t, const Neighbours& n) const {
  const Line *const L = f.lines + t, *const B = f.before + t;
  const auto& weights = f.weights.of_pair;
  PairSums s = no_sums(), s2 = no_sums();
  add_products(n.above, n.above_left, weights[0], s);
  add_products(n.above_right, values(L, -5, -1), weights[1], s2);
  add_products(values(L, -6, -2), n.stored_behind, weights[2], s);
  add_products(values(B, -1, 0), n.stored_behind_right, weights[3], s2);
  add_products(values(B, -3, -1), n.stored_behind_below, weights[4], s);
  add_products(values(B, -4, -1), values(B, -2, -1), weights[5], s2);
  add_products(values(B, 2, 1), values(B, 4, 1), weights[6], s);
  add_products(values(L, -s_.slice, 0), n.above_right2, weights[7], s2);
  add_products(n.left, f.last.left2, weights[8], s);
  return total(s, s2) + f.weights.constant;
}

/// A weighted sum of the sizes of residuals, except those on the left.
template <bool encoding>
TAGRID_STEP I16 Wave<encoding>::residuals_around(const Half& f, std::int64_t t,
                                                 const StepLanes& lanes) const {
  const Line *const L = f.lines + t, *const B = f.before + t;
  const I16 three = set16(3);
  const I16 row_above = sizes(L, -3, -1) * three + sizes(L, -4, -1) + sizes(L, -2, -1);
  I16 slice_behind = sizes(B, 0, 0) * three + sizes(B, 1, 0) + sizes(B, 3, 1);
  if (is_in_first_slice(f, lanes))
    slice_behind = if_else(first_slice_lanes(f, lanes), row_above, slice_behind);
  return row_above + slice_behind + sizes(L, -6, -2);
}

/// Corrects the sum by what was learned in the same context, and rounds it.
template <bool encoding>
TAGRID_STEP void Wave<encoding>::predict(Half& f, const Neighbours& n, I32 exact, I16 around,
                                         const StepLanes& lanes) {
  const I32 one = set32(1), left = widen(n.left);
  const I32 octave = min(shift_right<23>(float_of_twice(widen_unsigned(around))) - set32(127), set32(15));
  const I32 plain = shift_right<11>(exact);
  I32 bias = shift_right<1>(octave) * set32(24) + shift_left<3>(f.last.sign);
  bias = bias + if_or_zero(widen(n.above) > plain, one) + if_or_zero(left > plain, set32(2)) +
         if_or_zero(widen(n.behind) > plain, set32(4));
  const I32 corrected = exact + biases_.of(bias);
  const I32 rounded = shift_right<11>(corrected + set32(1024));
  f.predicted.fraction = corrected - shift_left<11>(rounded);
  f.predicted.value = if_else(widen(n.flat), left, min(max(rounded, low_), high_));
  f.predicted.bias_index = if_else(mask32(lanes.active & ~n.flat_lanes), bias, biases_.none());
  f.predicted.active = mask32(lanes.active);
}

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
