#include "pipeline/estimate/noise.h"

#include <algorithm>
#include <vector>

#include "pipeline/estimate/bricks_of_source.h"
#include "stages/survey/survey.h"

namespace tagrid {
namespace {

// Bands of this many rows of a slice are looked at, evenly over the volume.
constexpr std::int64_t band = 48;
constexpr std::int64_t most_samples = std::int64_t{1} << 24;

}  // namespace

double noise_of(VolumeSource& source) {
  const Index3 dims = source.info().dims;
  const std::int64_t of_slice = std::max<std::int64_t>(dims.y / band, 1), bands = of_slice * dims.z,
                     samples_of_band = dims.x * std::min(band, dims.y),
                     wanted = std::clamp<std::int64_t>(most_samples / samples_of_band, 1, bands);
  std::vector<float> deviations;
  for (std::int64_t i = 0; i < wanted; ++i) {
    const std::int64_t chosen = (2 * i + 1) * bands / (2 * wanted);
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
