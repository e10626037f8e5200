// A volume encoded in parts: by several processes, and so that a run that was interrupted goes on where it
// was.
#pragma once

#include "pipeline/encode/encode_run.h"
#include "pipeline/ranks/ranks.h"

namespace tagrid {

/// Encodes a volume in parts that all ranks make together; see encode_volume().
FinishedEncode encode_in_parts(Ranks& ranks, const EncodeRun& run);

}  // namespace tagrid
