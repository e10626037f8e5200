#include "io/volume/volume_info.h"

#include <fmt/format.h>

namespace tagrid {

std::string described(const Index3& dims, SampleType type) {
  return fmt::format("{} x {} x {} {}", dims.x, dims.y, dims.z, name_of(type));
}

std::optional<std::uint64_t> sample_bytes(const Index3& dims, SampleType type) {
  constexpr std::uint64_t limit = std::uint64_t{1} << 62;
  std::uint64_t bytes = size_of(type);
  for (int axis = 0; axis < 3; ++axis) {
    if (dims[axis] <= 0) return std::nullopt;
    if (static_cast<std::uint64_t>(dims[axis]) > (limit - 1) / bytes) return std::nullopt;
    bytes *= static_cast<std::uint64_t>(dims[axis]);
  }
  return bytes;
}

}  // namespace tagrid
