// The coder of lanes for machines with SSE4.
#include <hwy/detect_targets.h>

#if (HWY_TARGETS & HWY_SSE4 & ~HWY_STATIC_TARGET) != 0
#define TAGRID_TARGET HWY_SSE4
#include "stages/values/wavefront/target.h"
#endif
