// The coder of lanes for machines with AVX2.
#include <hwy/detect_targets.h>

#if (HWY_TARGETS & HWY_AVX2 & ~HWY_STATIC_TARGET) != 0
#define TAGRID_TARGET HWY_AVX2
#include "stages/values/wavefront/target.h"
#endif
