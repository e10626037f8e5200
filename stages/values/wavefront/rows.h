// Between rows of samples and lanes.
#pragma once

#include <cstdint>

#include "stages/values/wavefront/buffers.h"
#include "stages/values/wavefront/schedule.h"
#include "stages/values/wavefront/vectors.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

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

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
