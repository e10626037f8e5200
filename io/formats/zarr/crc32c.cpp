#include "io/formats/zarr/crc32c.h"

#include <isa-l/crc.h>

#include <algorithm>

namespace tagrid {

std::uint32_t crc32c(std::span<const std::byte> bytes) {
  constexpr std::size_t most = std::size_t{1} << 30;  // the library takes an int
  std::uint32_t sum = 0xffffffff;
  while (!bytes.empty()) {
    const std::span part = bytes.first(std::min(bytes.size(), most));
    // It only reads them.
    auto* data = reinterpret_cast<unsigned char*>(const_cast<std::byte*>(part.data()));
    sum = crc32_iscsi(data, static_cast<int>(part.size()), sum);
    bytes = bytes.subspan(part.size());
  }
  return ~sum;
}

}  // namespace tagrid
