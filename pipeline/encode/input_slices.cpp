#include "pipeline/encode/input_slices.h"

#include <algorithm>

namespace tagrid {

SliceSamples read_input_slice(VolumeReader& reader, const Box& rows) {
  const Index3 dims = reader.info().dims;
  const std::size_t row = static_cast<std::size_t>(dims.x) * size_of(reader.info().type);
  const bool whole = rows.size().y == dims.y;
  Box wanted = rows;
  if (!reader.random_access()) {
    wanted.low.y = 0;
    wanted.high.y = dims.y - 1;
    if (reader.next_sample() != rows.low.z * reader.slice_samples()) reader.seek_slice(rows.low.z);
  }
  auto slice = std::make_shared_for_overwrite<std::byte[]>(static_cast<std::size_t>(wanted.size().y) * row);
  reader.read_rows(slice.get(), wanted);
  if (wanted.high.y == dims.y - 1 && rows.high.z == dims.z - 1) reader.finish();
  if (whole || reader.random_access()) return slice;
  const std::size_t size = static_cast<std::size_t>(rows.size().y) * row;
  auto part = std::make_shared_for_overwrite<std::byte[]>(size);
  std::copy_n(slice.get() + static_cast<std::size_t>(rows.low.y) * row, size, part.get());
  return part;
}

}  // namespace tagrid
