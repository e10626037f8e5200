// The coder of lanes for what every machine has: NEON, or no vector instructions.
#include <hwy/detect_targets.h>

#define TAGRID_TARGET HWY_STATIC_TARGET
#include "stages/values/wavefront/target.h"
