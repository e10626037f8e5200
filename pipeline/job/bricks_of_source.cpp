#include "pipeline/job/bricks_of_source.h"

#include <oneapi/tbb/parallel_for.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "pipeline/job/input_slices.h"

namespace tagrid {

SliceRange slices_of_box(VolumeSource& source, const Box& box) {
  const Index3 dims = source.info().dims;
  Box rows = intersection(box, Box::of_size(dims));
  rows.low.x = 0;
  rows.high.x = dims.x - 1;
  SliceRange range = {rows.low.z, rows.low.y, nullptr};
  std::vector<SliceSamples> slices;
  const std::int64_t last = rows.high.z;
  for (std::int64_t z = rows.low.z; z <= last; ++z) {
    rows.low.z = rows.high.z = z;
    slices.push_back(read_input_slice(source, rows));
  }
  range.slices = std::make_shared<const std::vector<SliceSamples>>(std::move(slices));
  return range;
}

BrickSamples samples_of_box(const SliceRange& slices, const VolumeInfo& volume, const Box& box) {
  return {box, gather(slices, volume.dims, size_of(volume.type), box)};
}

void for_each_brick_of_row(VolumeSource& source, const BrickGrid& bricks, std::int64_t row,
                           const std::function<void(std::int64_t, const BrickSamples&)>& work) {
  const std::int64_t nx = bricks.bricks(0), ny = bricks.bricks(1);
  const Index3 first = {0, row % ny, row / ny};
  const Box box = {bricks.owned_box(first).low, bricks.owned_box({nx - 1, first.y, first.z}).high};
  const SliceRange slices = slices_of_box(source, box);
  oneapi::tbb::parallel_for(std::int64_t{0}, nx, [&](std::int64_t x) {
    const Index3 position = {x, first.y, first.z};
    work(bricks.id(position), samples_of_box(slices, source.info(), bricks.owned_box(position)));
  });
}

std::int64_t spread_row(std::int64_t i, std::int64_t wanted, std::int64_t rows) {
  // Somewhere in the i-th of equal stretches: multiples of the golden ratio leave no gaps and have no period.
  const double golden = 0.6180339887498949 * static_cast<double>(i), part = golden - std::floor(golden);
  const std::int64_t first = i * rows / wanted, end = (i + 1) * rows / wanted;
  return first + static_cast<std::int64_t>(part * static_cast<double>(end - first));
}

}  // namespace tagrid
