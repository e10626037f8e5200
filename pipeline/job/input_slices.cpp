#include "pipeline/job/input_slices.h"

#include "io/bytes/memory_size.h"

namespace tagrid {

SliceSamples read_input_slice(VolumeSource& source, const Box& rows) {
  const Index3 dims = source.info().dims;
  const std::size_t size =
      memory_size(static_cast<std::uint64_t>(rows.count()) * size_of(source.info().type));
  auto samples = std::make_shared_for_overwrite<std::byte[]>(size);
  source.read_rows(samples.get(), rows);
  if (rows.high.y == dims.y - 1 && rows.high.z == dims.z - 1) source.finish();
  return samples;
}

}  // namespace tagrid
