#include "io/volume/volume_sink.h"

#include <cassert>

namespace tagrid {

VolumeSink::VolumeSink(const VolumeInfo& info)
    : info_(info), bytes_left_(sample_bytes(info.dims, info.type).value()) {}

void VolumeSink::write_samples(std::int64_t first, std::span<const std::byte> samples) {
  const std::size_t size = size_of(info_.type);
  assert(samples.size() <= bytes_left_ && samples.size() % size == 0);
  bytes_left_ -= samples.size();
  write(first, samples);
  next_ = first + static_cast<std::int64_t>(samples.size() / size);
}

}  // namespace tagrid
