// How the distributions of symbols learn. Included once for each instruction set.
#if defined(TAGRID_STAGES_WAVEFRONT_MODELS) == defined(HWY_TARGET_TOGGLE)
#ifdef TAGRID_STAGES_WAVEFRONT_MODELS
#undef TAGRID_STAGES_WAVEFRONT_MODELS
#else
#define TAGRID_STAGES_WAVEFRONT_MODELS
#endif

#include "stages/wavefront/contexts.h"
#include "stages/wavefront/vectors.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

/// So many lanes of a step are coded one by one; more, all at once.
inline constexpr int few_lanes = 6;

/// A distribution, moved towards the observed symbol. Its first element is its age.
TAGRID_LANE I16 moved(const std::int16_t* distribution, I16 target) {
  const I16 now = load16(distribution);
  return now +
         mul_high(target - now, set16(learning_factor[static_cast<std::uint16_t>(distribution[0]) >> 10]));
}

/// All distributions of a group are read, then all are written, in the order of the lanes: of those that are the same, the
/// last lane wins.
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

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
