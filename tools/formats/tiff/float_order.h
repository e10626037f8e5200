// Floats whose bytes another program swapped.
#pragma once

#include <cstddef>
#include <span>

#include "stages/sample/sample_type.h"

namespace tagrid {

/// True if floats in the byte order of memory would be numbers of a usual size in the other order, and are
/// not in this one. `type` is float32 or float64.
bool look_swapped(std::span<const std::byte> samples, SampleType type);

}  // namespace tagrid
