// Parameters that depend on the samples of a volume: the only part of them that reads formats of volumes.
#include <algorithm>
#include <cmath>
#include <vector>

#include "io/files/errors.h"
#include "pipeline/encode/options.h"

namespace tagrid {
namespace {

std::pair<double, double> range_of_data(VolumeReader& reader) {
  if (!reader.seekable())
    throw UsageError(Sentence{"{} auto reads the volume twice, which a pipe does not allow; give {} lo:hi",
                              {setting::range, setting::range}});
  double low = INFINITY, high = -INFINITY;
  with_sample_type(reader.info().type, [&](auto type) {
    using T = decltype(type);
    // A slice may be larger than memory.
    const Index3& dims = reader.info().dims;
    const std::int64_t step = reader.whole_slices_only()
                                  ? dims.y
                                  : std::clamp<std::int64_t>((std::int64_t{1} << 20) / dims.x, 1, dims.y);
    std::vector<T> part;
    const auto take = [&] {
      if constexpr (std::is_integral_v<T>) {
        const auto [least, most] = std::minmax_element(part.begin(), part.end());
        low = std::min(low, static_cast<double>(*least));
        high = std::max(high, static_cast<double>(*most));
      } else {
        for (const T v : part) {
          if (!std::isfinite(v)) continue;
          low = std::min(low, static_cast<double>(v));
          high = std::max(high, static_cast<double>(v));
        }
      }
    };
    for (std::int64_t z = 0; z < dims.z; ++z)
      for (std::int64_t y = 0; y < dims.y; y += step) {
        const Box rows{{0, y, z}, {dims.x - 1, std::min(y + step, dims.y) - 1, z}};
        part.resize(static_cast<std::size_t>(rows.count()));
        reader.read_rows(reinterpret_cast<std::byte*>(part.data()), rows);
        take();
      }
  });
  reader.finish();
  reader.rewind();
  if (low > high) low = high = 0;  // no sample is finite
  if (low == high) ++high;         // a constant volume: any scale is good
  return {low, high};
}

}  // namespace

bool takes_range_from_data(const EncodeOptions& options, const VolumeReader& reader) {
  if (options.range || options.field_scale) return false;
  return options.range_from_data || (is_wide_type(reader.info().type) && reader.seekable());
}

CodingParameters resolve(const EncodeOptions& options, VolumeReader& reader) {
  // Mistakes are reported before the volume is read.
  parameters_but_scale(options, reader.info());
  std::optional<std::pair<double, double>> range;
  if (takes_range_from_data(options, reader)) range = range_of_data(reader);
  return resolve(options, reader.info(), reader.files().front(), range);
}

}  // namespace tagrid
