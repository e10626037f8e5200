// The memory of the lanes of a brick: one block of the heap, whose size is known before.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "stages/values/wavefront/contexts.h"
#include "stages/values/wavefront/schedule.h"

namespace tagrid {

/// Where lane 0 is in a line. Before and after the lanes are rows of the groups above and below.
inline constexpr int first_lane = 8;

/// Values, and sizes of residuals, of one step.
struct alignas(64) Line {
  std::int16_t value[32];
  std::int16_t size[32];
};

/// What the coder of symbols needs of a step.
struct alignas(64) Coded {
  std::int16_t texture[wave_lanes], level[wave_lanes];  ///< elements before the distributions
  std::int16_t symbol[wave_lanes], low_bits[wave_lanes];
  std::int32_t turned[wave_lanes];  ///< residuals
  std::uint16_t lanes, far, low, extra;
};

/// Lanes with 3 i <= phase: they have begun their row of a group.
inline std::uint32_t begun_bits(std::int64_t phase) {
  return (2u << static_cast<std::uint32_t>(phase) / wave_skew) - 1;
}
struct BegunLanes {
  std::int16_t of_phase[wave_slope + 8][wave_lanes];
};
inline constexpr BegunLanes begun_lanes = [] {
  BegunLanes b{};
  for (int phase = 0; phase < wave_slope + 8; ++phase)
    for (int i = 0; i < wave_lanes; ++i) b.of_phase[phase][i] = wave_skew * i <= phase ? -1 : 0;
  return b;
}();

/// Sixteen rows with room for what lanes read before and after them.
struct Strip {
  static constexpr std::int64_t margin = 64;
  std::int16_t* first = nullptr;
  std::int64_t stride = 0;

  std::int16_t* row(std::int64_t i) const { return first + i * stride + margin; }
};

/// Intervals of the symbols of a step.
struct alignas(64) Intervals {
  std::int32_t of_lane[wave_lanes];  ///< start, and end in the upper half
};
/// Up to this number of symbols, a brick has one state.
inline constexpr std::size_t single_state_symbols = 4096;

struct IntervalLanes {
  std::uint16_t coded, first, last, low;
};

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

class WaveBuffers {
 public:
  Schedule schedule;
  std::unique_ptr<std::byte[]> memory;
  std::int16_t* tables;
  std::uint16_t* voxel_lanes;  ///< by phase: lanes at a voxel
  Strip strip;
  std::int64_t reach, ahead, capacity;  ///< of lines
  Line* lines[2];
  std::int16_t (*originals[2])[wave_lanes] = {};
  std::uint16_t* surface[2] = {};
  Coded* coded[2] = {};
  Intervals* intervals = nullptr;
  IntervalLanes* interval_lanes = nullptr;
  std::array<std::vector<std::uint16_t>, 2> quiet;
  std::int64_t first_line;  ///< the step of the first line that is kept

  /// The heap that these take.
  static std::uint64_t bytes(Index3 size, bool encoding, bool two_bounds);

  WaveBuffers(Index3 size, bool encoding, bool two_bounds, std::int16_t reference);

 private:
  explicit WaveBuffers(Index3 size);
};

}  // namespace tagrid
