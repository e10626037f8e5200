#include "io/formats/file_checksum.h"

#include <algorithm>
#include <vector>

#include "io/bytes/checksum.h"
#include "io/files/file_bytes.h"

namespace tagrid {

std::uint64_t checksum_of_file(const std::string& path) {
  FileBytes file(path);
  RunningChecksum checksum;
  std::vector<std::byte> bytes(std::size_t{1} << 20);
  for (;;) {
    const std::size_t count = file.read(bytes.data(), bytes.size());
    checksum.add({bytes.data(), count});
    if (count < bytes.size()) return checksum.value();
  }
}

std::uint64_t checksum_of_samples(VolumeReader reader) {
  const Index3 dims = reader.info().dims;
  const std::int64_t row_bytes = dims.x * static_cast<std::int64_t>(size_of(reader.info().type));
  // A slice may be larger than memory.
  const std::int64_t rows = reader.whole_slices_only()
                                ? dims.y
                                : std::clamp<std::int64_t>((std::int64_t{1} << 20) / row_bytes, 1, dims.y);
  std::vector<std::byte> bytes(static_cast<std::size_t>(rows * row_bytes));
  RunningChecksum checksum;
  for (std::int64_t z = 0; z < dims.z; ++z)
    for (std::int64_t y = 0; y < dims.y; y += rows) {
      const std::int64_t last = std::min(y + rows, dims.y) - 1;
      reader.read_rows(bytes.data(), {{0, y, z}, {dims.x - 1, last, z}});
      checksum.add({bytes.data(), static_cast<std::size_t>((last - y + 1) * row_bytes)});
    }
  reader.finish();
  return checksum.value();
}

}  // namespace tagrid
