#include "pipeline/job/noise.h"

#include <algorithm>
#include <vector>

#include "pipeline/job/bricks_of_source.h"
#include "stages/survey/survey.h"

namespace tagrid {
namespace {

// Bands of this many rows of a slice are looked at, spread over the volume: blocks of 8 x 8 of them.
constexpr std::int64_t band = 48;
constexpr std::int64_t most_blocks = std::int64_t{1} << 18;

}  // namespace

double noise_of(VolumeSource& source) {
  const Index3 dims = source.info().dims;
  const std::int64_t of_slice = std::max<std::int64_t>(dims.y / band, 1), bands = of_slice * dims.z,
                     blocks = std::max<std::int64_t>(dims.x / 8, 1) *
                              (std::min(band, dims.y) / std::min<std::int64_t>(8, dims.y)),
                     wanted = std::clamp<std::int64_t>(most_blocks / blocks, 1, bands);
  std::vector<double> deviations;
  for (std::int64_t i = 0; i < wanted; ++i) {
    const std::int64_t chosen = spread_row(i, wanted, bands);
    const Index3 low = {0, chosen % of_slice * dims.y / of_slice, chosen / of_slice};
    const Box box = intersection({low, low + Index3{dims.x - 1, band - 1, 0}}, Box::of_size(dims));
    const BrickSamples samples = samples_of_box(slices_of_box(source, box), source.info(), box);
    with_sample_type(source.info().type, [&](auto type) {
      using T = decltype(type);
      append_deviations(Samples<T>{box, reinterpret_cast<const T*>(samples.bytes.data())}, deviations);
    });
  }
  source.rewind();
  return usual_deviation(deviations);
}

}  // namespace tagrid
