// Samples of single bricks, read from a volume in any order.
#pragma once

#include <cstdint>
#include <functional>

#include "io/volume/volume_source.h"
#include "pipeline/grid/slices.h"
#include "stages/volume/coding_parameters.h"
#include "stages/volume/samples.h"

namespace tagrid {

/// The slices of a box, as far as the volume reaches: of each, the rows of the box. Throws as VolumeSource does.
/// REQUIRES: source.traits().any_rows.
SliceRange slices_of_box(VolumeSource& source, const Box& box);

/// The samples of a box. A point outside the volume has the value of the nearest sample.
BrickSamples samples_of_box(const SliceRange& slices, const VolumeInfo& volume, const Box& box);

/// Calls work(brick number, samples that it owns) for every brick of a row along x, on the threads of the arena. `row` is
/// the number of the row: y + z * bricks(1).
void for_each_brick_of_row(VolumeSource& source, const BrickGrid& bricks, std::int64_t row,
                           const std::function<void(std::int64_t, const BrickSamples&)>& work);

/// The i-th of `wanted` rows out of `rows`: spread over all of them, but not at equal distances, which could be those of
/// the volume itself.
std::int64_t spread_row(std::int64_t i, std::int64_t wanted, std::int64_t rows);

}  // namespace tagrid
