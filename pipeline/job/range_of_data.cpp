// Parameters that depend on the samples of a volume. Only this part of them reads volumes.
#include <algorithm>
#include <cmath>

#include "io/files/errors.h"
#include "pipeline/job/options.h"

namespace tagrid {

std::optional<std::pair<double, double>> range_of_data(VolumeSource& source) {
  if (!source.traits().again)
    throw UsageError(Sentence{"{} auto reads the volume twice, which a pipe does not allow; give {} lo:hi",
                              {setting::range, setting::range}});
  double low = INFINITY, high = -INFINITY;
  with_sample_type(source.info().type, [&](auto type) {
    using T = decltype(type);
    read_to_end(source, [&](std::span<const std::byte> bytes) {
      const std::span part(reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T));
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
    });
  });
  source.rewind();
  if (low > high) return std::nullopt;
  return std::pair(low, high);
}

bool takes_range_from_data(const EncodeOptions& options, const VolumeSource& source) {
  if (options.range || options.field_scale) return false;
  return options.range_from_data || (is_wide_type(source.info().type) && source.traits().again);
}

CodingParameters resolve(const EncodeOptions& options, VolumeSource& source) {
  // Mistakes are reported before the volume is read.
  parameters_but_scale(options, source.info());
  std::optional<std::pair<double, double>> range;
  if (takes_range_from_data(options, source)) {
    range = range_of_data(source).value_or(std::pair(0.0, 0.0));
    if (range->first == range->second) ++range->second;  // a constant volume: any scale is good
  }
  return resolve(options, source.info(), source.name(), range);
}

}  // namespace tagrid
