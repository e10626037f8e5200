// A synthetic CT volume of any size, for tests and measurements: tissue with slow gradients, bones, lungs,
// foam, thin shells and metal in a patient on a table, with correlated noise, inside a round field of view.
#pragma once

#include <cstdint>
#include <span>

#include "stages/grid/box.h"

namespace tagrid {

/// Makes slice `z` of a volume of size `dims`: dims.x * dims.y samples, x fastest. A pure function of its
/// arguments, with the same samples on every machine. Slices can be made in any order, and each takes the
/// same time, whatever z is. The content scales with dims.x and dims.y, and varies without end along z.
///
/// Samples of int16 and int32 are in HU, -1024 to 3071 (-1024 outside the field of view). Samples of uint16
/// and uint32 are in HU + 1024. Samples of 8 bits are in steps of 10 HU, from the type's lowest value on.
/// Floats are in HU, not rounded. REQUIRES: positive sizes, 0 <= z < dims.z, out.size() == dims.x * dims.y.
/// T: the sample types.
template <class T>
void phantom_slice(const Index3& dims, std::uint64_t seed, std::int64_t z, std::span<T> out);

}  // namespace tagrid
