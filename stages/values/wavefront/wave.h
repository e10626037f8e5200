// The lanes of both halves of a brick, the even and the odd slices, from step to step: what they know, and
// how they go on; the same for encoding and decoding. What happens in a step is in step.h.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "stages/values/wavefront/biases.h"
#include "stages/values/wavefront/buffers.h"
#include "stages/values/wavefront/coder.h"
#include "stages/values/wavefront/contexts.h"
#include "stages/values/wavefront/schedule.h"
#include "stages/values/wavefront/vectors.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

// ---- What is known only within a step

struct StepLanes {
  int half;
  std::uint32_t begun;   ///< lanes that have begun their row of the group; others are in the group before
  std::uint32_t active;  ///< lanes at a voxel
};

/// The bits `now` of lanes that have begun their group, and the bits `before` of the others.
TAGRID_LANE std::uint32_t mixed(std::uint32_t now, std::uint32_t before, std::uint32_t begun) {
  return (now & begun) | (before & ~begun);
}

/// Values around the voxels of a step. Behind is the slice before; in the first slice, the value above stands
/// for its values, except for those that are stored.
struct Neighbours {
  I16 left, above, above_left, above_right, above_right2, behind;
  I16 stored_behind, stored_behind_right, stored_behind_below;
  I16 largest, smallest;  ///< of the row above and the slice before
  M16 flat;               ///< all of them have the value on the left
  std::uint32_t flat_lanes;
  I16 original;  ///< encoding: the voxels themselves
};

/// The bound of each lane.
struct StepBound {
  M32 surface;  ///< lanes with the bound of active points
  I32 error;
  F32 reciprocal;  ///< of the step
};

/// Elements of the two distributions of a symbol, and how many low bits it leaves out.
struct Contexts {
  I32 texture, level, low_bits;
};

// ---- What the next steps need

/// Where a half is in its schedule.
struct Progress {
  std::int64_t phase = 0;                     ///< steps since the group began
  std::int64_t group = -1, of_slice = -1;     ///< the group, counted from the first one, and in its slice
  std::uint16_t rows = 0, rows_before = 0;    ///< lanes with a row, in this group and in the one before
  std::uint16_t quiet = 0, quiet_before = 0;  ///< decoding: of these, rows without a residual
};

/// What the next steps need of the last ones: values, and sizes of residuals.
struct LastSteps {
  I16 left, left2, size, size2;
  I32 sign;  ///< of the residual on the left, plus 1
};

/// What the front of a step leaves for its back.
struct Predicted {
  bool slow;                    ///< false: all voxels have the value on their left
  std::uint32_t fresh, absent;  ///< lanes that begin a row, lanes without a row
  I16 above, above2;            ///< values of the row above, and two voxels further
  M32 active;                   ///< lanes at a voxel
  I32 value, fraction;          ///< the prediction, and what rounding took from it, in 2^-11
  I32 step;                     ///< of the quantizer
  I32 bias_index, usual;        ///< whose error is learned, and how large it may be
  M32 flip;                     ///< lanes whose residual is coded with the other sign
};

/// What the decoder of symbols needs of a step, and what it finds.
struct Decoding {
  std::uint32_t coded, any_low;  ///< lanes with a symbol, lanes with bits without a model
  I32 low_bits;                  ///< number of these bits
  I32 largest;                   ///< residual
  alignas(64) std::int16_t texture[wave_lanes], level[wave_lanes];  ///< elements before the distributions
  alignas(64) std::int32_t interval[wave_lanes] = {}, symbol[wave_lanes] = {};
  I32 state;
};

/// The weights of the neighbors, for the slice of each lane; in pairs, as add_products() takes them.
struct LaneWeights {
  alignas(64) std::int16_t of_pair[9][32];
  I32 constant;
};

/// What a step of the even or of the odd slices needs of the ones before it.
struct Half {
  Line *lines, *before, *next;  ///< own; those of the slice before, and of the one after, at the same index
  std::int16_t (*originals)[wave_lanes];
  std::uint16_t* surface;  ///< active points
  Progress at;
  LaneWeights weights;
  LastSteps last;
  Predicted predicted;
  I32 residual;
  Coded* record;  ///< encoding: where the step is kept for the coder of symbols
  Decoding decoding;
};

// ---- Between rows of samples and lanes

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

inline constexpr int error_limit = 1 << 22;

/// A bound in every lane; see Quantizer.
struct LaneBound {
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
    }
    any_exact_ = brick.errors[0] == 0 || (two_bounds_ && brick.errors[1] == 0);
    least_error_ =
        set16(static_cast<int>(std::min<std::int64_t>(std::min(brick.errors[0], brick.errors[1]), 32767)));
    level_tables_ = buffers.tables + (brick.one_distribution ? 0 : level_offset);
    std::memcpy(buffers.tables, initial_distributions().data(), distribution_elements * 2);
    for (int h = 0; h < 2; ++h) {
      Half& f = half_[h];
      f.lines = buffers.lines[h];
      f.originals = buffers.originals[h];
      f.surface = buffers.surface[h];
      f.weights.constant = set32(0);
      for (int i = 0; i < wave_lanes; ++i) set_weights(f, i, h);
      f.last.left = f.last.left2 = set16(p.reference);
      f.last.size = f.last.size2 = set16(0);
      f.last.sign = set32(1);
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
    store(f.weights.constant, constant);
    constant[i] = brick_.parameters.reference * (2048 - w.sum());
    f.weights.constant = load32(constant);
    const int at = (i & 4) * 4 + 2 * ((i & 3) + (i >> 3) * 4);
    for (int j = 0; j < 9; ++j) {
      f.weights.of_pair[j][at] = static_cast<std::int16_t>(w.of_tap[static_cast<std::size_t>(pair[j][0])]);
      f.weights.of_pair[j][at + 1] =
          static_cast<std::int16_t>(w.of_tap[static_cast<std::size_t>(pair[j][1])]);
    }
  }

  /// The second distributions, or null if the first ones stand for them.
  std::int16_t* learning_levels() const { return brick_.one_distribution ? nullptr : level_tables_; }

  void begin_group(Half& f, int h) {
    ++f.at.group;
    if (++f.at.of_slice == s_.groups) f.at.of_slice = 0;
    f.at.rows_before = f.at.rows;
    f.at.rows = static_cast<std::uint16_t>((1u << s_.rows_of(h, f.at.group)) - 1);
    if constexpr (!encoding) {
      f.at.quiet_before = f.at.quiet;
      f.at.quiet = f.at.group < s_.all_groups
                       ? (*given_quiet_)[static_cast<std::size_t>(h)][static_cast<std::size_t>(f.at.group)]
                       : 0;
    }
  }

  /// Copies the rows of line t that neighbors in other groups and slices read.
  TAGRID_STEP void copy_borders(Half& f, std::int64_t t) {
    Line* const l = f.lines + t;
    const std::int64_t up = s_.period - wave_slope, of_slice = f.at.of_slice;
    const bool last = of_slice == s_.groups - 1;
    // Lanes 14 and 15 may still be in the group before.
    const bool last14 = f.at.phase >= 42 ? last : of_slice == 0,
               last15 = f.at.phase >= 45 ? last : of_slice == 0;
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
  /// Drops the lines that are no longer read.
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

  TAGRID_LANE I32 by_bound(const I32& of_inactive, const I32& of_active, M32 surface) const {
    return two_bounds_ ? if_else(surface, of_active, of_inactive) : of_inactive;
  }

  /// True if some lanes are in the first slice.
  TAGRID_LANE bool is_in_first_slice(const Half& f, const StepLanes& lanes) const {
    return lanes.half == 0 && f.at.group <= s_.groups;
  }
  /// Those lanes. REQUIRES: there are some.
  TAGRID_LANE M16 first_slice_lanes(const Half& f, const StepLanes& lanes) const {
    return mask16(f.at.group < s_.groups ? 0xffff : ~lanes.begun);
  }

  // A step; see predict.h and step.h.
  TAGRID_STEP void front(Half& f, int h, std::int64_t t);
  TAGRID_STEP void back(Half& f, std::int64_t t);

  TAGRID_STEP StepLanes begin_step(Half& f, int h, std::int64_t t);
  TAGRID_STEP Neighbours neighbours_of(Half& f, std::int64_t t, const StepLanes& lanes) const;
  TAGRID_STEP bool repeats(const Half& f, const Neighbours& n, const StepLanes& lanes) const;
  TAGRID_STEP I32 weighted_sum(const Half& f, std::int64_t t, const Neighbours& n) const;
  TAGRID_STEP I16 residuals_around(const Half& f, std::int64_t t, const StepLanes& lanes) const;
  TAGRID_STEP void predict(Half& f, const Neighbours& n, I32 exact, I16 around, const StepLanes& lanes);
  TAGRID_STEP StepBound bound_of(Half& f, std::int64_t t) const;
  TAGRID_STEP Contexts contexts_of(Half& f, const Neighbours& n, I16 around, const StepBound& bound) const;
  TAGRID_STEP I32 place_of(Half& f, I32 above_top, I32 below_bottom, const StepBound& bound, M32 flat) const;
  TAGRID_STEP void quantize(Half& f, const Neighbours& n, const StepBound& bound, const Contexts& contexts,
                            const StepLanes& lanes);
  TAGRID_STEP void record_flat(Half& f, const StepLanes& lanes);
  TAGRID_STEP void keep(Half& f, const StepBound& bound, const Contexts& contexts, const StepLanes& lanes);

  const WaveBrick& brick_;
  const Schedule& s_;
  WaveBuffers& buffers_;
  RowReader reader_;
  RowWriter writer_;
  const RowSet* given_quiet_;
  const bool two_bounds_;
  Half half_[2];
  I32 low_, high_, level_scale_;
  LaneBound bounds_[2];
  bool any_exact_;              ///< some voxels have the bound 0
  std::int16_t* level_tables_;  ///< the second distribution of a symbol
  I16 least_error_;
  Biases biases_;
};

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
