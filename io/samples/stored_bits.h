// Samples of which only some bits count, as scanners store them.
#pragma once

#include <cstddef>

#include "io/volume/slice_run.h"
#include "stages/volume/sample_type.h"

namespace tagrid {

/// Turns `count` integers of the size of `type` into samples of that type, where they are. What is beyond the type wraps
/// around. REQUIRES: an integer type of at most 32 bits.
void apply(const StoredBits& stored, SampleType type, std::byte* samples, std::size_t count);

}  // namespace tagrid
