// The contexts in which residuals are coded, and the distributions of their symbols.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stages/entropy/symbol_model.h"

namespace tagrid {

// A symbol has two distributions. The first is selected by the size of the residuals around, the spread of
// the values around, the sign of the residual on the left, and whether the prediction is outside of the values
// around; the second by the level of the prediction, the size of the residuals, and the place of the prediction
// among the values around. In each, one more is for voxels whose neighbors are all equal, and one takes what
// lanes without a voxel do.
inline constexpr int texture_contexts = 16 * 8 * 4 * 2, level_contexts_of_wave = 32 * 4 * 8;
inline constexpr int flat_texture = texture_contexts, idle_texture = texture_contexts + 1;
inline constexpr int flat_level = level_contexts_of_wave, idle_level = level_contexts_of_wave + 1;
inline constexpr int distribution_count = texture_contexts + 2 + level_contexts_of_wave + 2;
/// Elements of 16 bits from the first distributions to the second.
inline constexpr std::size_t level_offset = (texture_contexts + 2) * symbol_count;
/// One distribution more, since a symbol's end is read from the next one.
inline constexpr std::size_t distribution_elements = (distribution_count + 1) * symbol_count;

/// The distributions before anything is coded.
const std::vector<std::int16_t>& initial_distributions();

}  // namespace tagrid
