// The positions of the bricks in the bytes of a .tag file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace tagrid {

/// The frames of the bricks of a file, as offset and size.
inline std::vector<std::pair<std::size_t, std::size_t>> frames(const std::string& file) {
  const auto u32 = [&](std::size_t at) {
    std::uint32_t v;
    std::memcpy(&v, file.data() + at, 4);
    return v;
  };
  std::vector<std::pair<std::size_t, std::size_t>> result;
  for (std::size_t at = u32(12); u32(at) != 0; at += result.back().second)
    result.emplace_back(at, 4 + u32(at) + 8);
  return result;
}

}  // namespace tagrid
