// Floats whose bytes another program swapped.
#pragma once

#include <cstddef>
#include <span>

#include "stages/sample/sample_type.h"

namespace tagrid {

enum class FloatOrder { usual, swapped, unclear };

/// What the sizes of floats say of their byte order. `usual`: that of memory, in which `samples` are; `swapped`: the
/// other one; `unclear`: in both, many are larger or smaller than most programs have them. `type` is float32 or float64.
FloatOrder float_order_of(std::span<const std::byte> samples, SampleType type);

}  // namespace tagrid
