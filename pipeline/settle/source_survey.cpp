#include "pipeline/settle/source_survey.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "io/errors/errors.h"
#include "pipeline/job/options.h"
#include "pipeline/slices/slices_ahead.h"
#include "stages/survey/survey.h"

namespace tagrid {
namespace {

// Bands of this many rows of a slice are looked at, spread over the volume: blocks of 8 x 8 of them.
constexpr std::int64_t band = 48;
constexpr std::int64_t most_blocks = std::int64_t{1} << 18;

}  // namespace

Noise noise_of(VolumeSource& source) {
  const Index3 dims = source.info().dims;
  const std::int64_t of_slice = std::max<std::int64_t>(dims.y / band, 1), bands = of_slice * dims.z,
                     blocks = std::max<std::int64_t>(dims.x / 8, 1) *
                              (std::min(band, dims.y) / std::min<std::int64_t>(8, dims.y)),
                     wanted = std::clamp<std::int64_t>(most_blocks / blocks, 1, bands);
  const Box volume = Box::of_size(dims);
  std::vector<double> deviations;
  std::int64_t samples_read = 0;
  for (std::int64_t i = 0; i < wanted; ++i) {
    const std::int64_t chosen = spread_row(i, wanted, bands);
    const Index3 low = {0, chosen % of_slice * dims.y / of_slice, chosen / of_slice};
    const Box box = intersection({low, low + Index3{dims.x - 1, band - 1, 0}}, volume);
    samples_read += box.count();
    const BrickSamples samples = gather(slices_of_box(source, volume, box), volume, source.info().type, box);
    with_sample_type(source.info().type, [&](auto type) {
      using T = decltype(type);
      append_deviations(Samples<T>{box, reinterpret_cast<const T*>(samples.bytes.data())}, deviations);
    });
  }
  source.rewind();
  const double usual = usual_deviation(deviations);
  const double times_read = static_cast<double>(samples_read) / static_cast<double>(volume.count());
  if (!is_doubtful(usual, deviations)) return {usual, "", times_read};
  return {usual,
          "the noise is probably far too large: few regions are uniform, and many of them vary by less than "
          "half of it; measure the noise in a uniform region, and give the bound as a number",
          times_read};
}

std::optional<std::pair<double, double>> range_of_data(VolumeSource& source) {
  require(source.traits().again,
          {"{} auto reads the volume twice, which a pipe does not allow; give {} lo:hi", setting::range,
           setting::range});
  ValueRange range;
  read_to_end(source,
              [&](std::span<const std::byte> bytes) { range.add(value_range(bytes, source.info().type)); });
  source.rewind();
  if (range.finite == 0) return std::nullopt;
  return std::pair(range.low, range.high);
}

SliceRange slices_of_box(VolumeSource& source, const Box& volume, const Box& box) {
  Box rows = intersection(box, volume);
  rows.low.x = volume.low.x;
  rows.high.x = volume.high.x;
  SliceRange range = {rows.low.z, rows.low.y, nullptr};
  std::vector<SliceSamples> slices;
  const std::int64_t last = rows.high.z;
  for (std::int64_t z = rows.low.z; z <= last; ++z) {
    rows.low.z = rows.high.z = z;
    slices.push_back(read_input_slice(source, rows.moved(-1 * volume.low)));
  }
  range.slices = std::make_shared<const std::vector<SliceSamples>>(std::move(slices));
  return range;
}

void for_each_brick_of_row(VolumeSource& source, const BrickGrid& bricks, std::int64_t row,
                           const std::function<void(std::int64_t, const BrickSamples&)>& work) {
  const std::int64_t y = row % bricks.bricks(1), z = row / bricks.bricks(1);
  const Box volume = bricks.domain.volume();
  const SliceRange slices = slices_of_box(source, volume, BrickRows{y, y + 1, z, z + 1}.owned(bricks));
  const SampleType type = source.info().type;
  oneapi::tbb::parallel_for(std::int64_t{0}, bricks.bricks(0), [&](std::int64_t x) {
    const Index3 position = {x, y, z};
    work(bricks.id(position), gather(slices, volume, type, bricks.owned_box(position)));
  });
}

std::int64_t spread_row(std::int64_t i, std::int64_t wanted, std::int64_t rows) {
  // Somewhere in the i-th of equal stretches: multiples of the golden ratio leave no gaps and have no period.
  const double golden = 0.6180339887498949 * static_cast<double>(i), part = golden - std::floor(golden);
  const std::int64_t first = i * rows / wanted, end = (i + 1) * rows / wanted;
  return first + static_cast<std::int64_t>(part * static_cast<double>(end - first));
}

}  // namespace tagrid
