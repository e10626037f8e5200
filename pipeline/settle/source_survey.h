// Looks at samples before encoding: noise, range, and single bricks.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "io/volume/volume_source.h"
#include "pipeline/grid/slices.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/samples.h"

namespace tagrid {

struct Noise {
  double deviation = 0;   ///< standard deviation, in units of samples
  std::string doubt;      ///< why it is probably wrong, and what to do; "" if nothing says that
  double times_read = 0;  ///< how often a sample was read, on average
};

/// The standard deviation of the noise of a volume: that of its samples from planes that fit small blocks,
/// where most blocks agree (see stages/survey/survey.h). Reads a sample of the volume, a quarter of a million
/// blocks. 0 if no block is noisy. REQUIRES: source.traits().any_rows.
Noise noise_of(VolumeSource& source);

/// The range of finite samples, if there are any. Reads and rewinds the volume; UsageError if it cannot.
std::optional<std::pair<double, double>> range_of_data(VolumeSource& source);

/// The rows of a box from its slices, within the volume, whose first sample is volume.low. REQUIRES:
/// source.traits().any_rows.
SliceRange slices_of_box(VolumeSource& source, const Box& volume, const Box& box);

/// Calls work(brick number, samples that it owns) for every brick of a row along x, on the threads of the
/// arena. `row` is the number of the row: y + z * bricks(1).
void for_each_brick_of_row(VolumeSource& source, const BrickGrid& bricks, std::int64_t row,
                           const std::function<void(std::int64_t, const BrickSamples&)>& work);

/// The i-th of `wanted` rows out of `rows`: spread over all, but not evenly, as the volume may be periodic.
std::int64_t spread_row(std::int64_t i, std::int64_t wanted, std::int64_t rows);

}  // namespace tagrid
