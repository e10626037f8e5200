// Encodes a volume in parts: with several processes, and so that an interrupted run can continue.
#pragma once

#include "pipeline/encode/encode_run.h"
#include "pipeline/ranks/ranks.h"

namespace tagrid {

/// Encodes a volume in parts, on which all ranks work together; see encode_volume().
FinishedEncode encode_in_parts(Ranks& ranks, const EncodeRun& run);

}  // namespace tagrid
