// How the distributions of symbols learn.
#pragma once

#include <bit>

#include "stages/values/wavefront/contexts.h"
#include "stages/values/wavefront/schedule.h"
#include "stages/values/wavefront/vectors.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

/// So many lanes of a step are coded one by one; more, all at once.
inline constexpr int few_lanes = 6;

/// A distribution, moved towards the observed symbol. Its first element is its age.
TAGRID_LANE I16 moved(const std::int16_t* distribution, I16 target) {
  const I16 now = load16(distribution);
  return now + shift_right(target - now, learning_rates[static_cast<std::uint16_t>(distribution[0]) >> 10]);
}

/// All distributions of a group are read, then all are written, in the order of the lanes: of those that are
/// the same, the last lane wins.
TAGRID_LANE void learn_eight(std::int16_t* tables, const std::int16_t* of_lane, const I16* target) {
  I16 model[8];
  TAGRID_UNROLL
  for (int i = 0; i < 8; ++i) model[i] = moved(tables + of_lane[i], target[i]);
  TAGRID_UNROLL
  for (int i = 0; i < 8; ++i) store(model[i], tables + of_lane[i]);
}
TAGRID_LANE I16 target_of(int symbol) {
  return load16(symbol_targets.of[static_cast<std::size_t>(symbol)].data());
}

/// Both distributions of the symbol of each lane in `lanes` learn it. `level_tables` is null if there is only
/// one.
template <class Symbol>
TAGRID_STEP void learn_symbols(std::int16_t* texture_tables, std::int16_t* level_tables,
                               const std::int16_t* texture, const std::int16_t* level, const Symbol* symbol,
                               std::uint32_t lanes) {
  if (std::popcount(lanes) > few_lanes) {
    TAGRID_UNROLL
    for (int g = 0; g < wave_lanes; g += 8) {
      I16 target[8];
      TAGRID_UNROLL
      for (int i = 0; i < 8; ++i) target[i] = target_of(symbol[g + i]);
      learn_eight(texture_tables, texture + g, target);
      if (level_tables != nullptr) learn_eight(level_tables, level + g, target);
    }
    return;
  }
  for (std::uint32_t left = lanes; left != 0; left &= left - 1) {
    const int i = std::countr_zero(left);
    const I16 target = target_of(symbol[i]);
    store(moved(texture_tables + texture[i], target), texture_tables + texture[i]);
    if (level_tables != nullptr) store(moved(level_tables + level[i], target), level_tables + level[i]);
  }
}

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
