// A filter of what a transform has restored: to each coefficient that stands for a sample again, weighted differences
// to its neighbours are added. They are limited at three levels, so that what blurs noise keeps edges. The weights
// are those of the file; the encoder fits them to the errors of a trial.
#pragma once

#include <cstdint>
#include <span>

#include "stages/grid/box.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/filter_fit.h"

namespace tagrid {

/// Filters a brick in place. Only samples of the brick are read. The same on every machine, for any numbers.
///   values         those of samples, x fastest, with `fraction_bits` bits after the point
///   step           see TransformBrick
void filter_brick(std::span<std::int32_t> values, Index3 size, std::uint32_t step, int fraction_bits,
                  const FilterWeights& weights);

/// Adds every fourth row of a brick. `lacking`: original values less `values`.
void add_to_sums(std::span<const std::int32_t> values, std::span<const std::int32_t> lacking, Index3 size,
                 std::uint32_t step, int fraction_bits, FilterSums& sums);

/// The heap that a filter takes.
std::uint64_t working_bytes_of_filter(Index3 size);

}  // namespace tagrid
