// The one way of encoding: a request is settled, its bricks go into a store, and the source files after them.
#pragma once

#include <memory>

#include "pipeline/encode/brick_store.h"
#include "pipeline/encode/encode_run.h"
#include "pipeline/memory/resources.h"

namespace tagrid {

/// Encodes a volume into a store. `resources` are those of this process. Throws as encode_volume() does.
FinishedEncode encode_into(std::shared_ptr<BrickStore> store, const EncodeRun& run,
                           const Resources& resources);

/// A store that writes one stream, which this process encodes. Both arguments must outlive all calls but
/// commit().
std::unique_ptr<BrickStore> store_of_stream(const EncodeRun& run, const Resources& resources);

}  // namespace tagrid
