// Encodes a volume in parts: with several processes, and so that an interrupted run can continue.
#pragma once

#include <memory>

#include "pipeline/encode/brick_store.h"
#include "pipeline/ranks/ranks.h"

namespace tagrid {

/// A store of parts, on which all ranks work together. Both arguments must outlive all calls but commit().
std::unique_ptr<BrickStore> store_of_parts(Ranks& ranks, const EncodeRun& run);

}  // namespace tagrid
