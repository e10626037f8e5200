// Floats whose bytes another program swapped.
#pragma once

#include <cstddef>
#include <span>

#include "stages/sample/sample_type.h"

namespace tagrid {

enum class FloatOrder { usual, swapped, unclear };

/// The byte order of floats, judged by their magnitudes. `usual`: they have the byte order of
/// memory; `swapped`: they have the other one; `unclear`: in both orders, many are unusually large
/// or small. `type` is float32 or float64.
FloatOrder float_order_of(std::span<const std::byte> samples, SampleType type);

}  // namespace tagrid
