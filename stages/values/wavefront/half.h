// What the steps of the even or of the odd slices know.
#pragma once

#include <cstdint>

#include "stages/values/wavefront/buffers.h"
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

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
