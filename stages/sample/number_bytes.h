// Numbers as bytes of coded values, the lowest byte first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tagrid {

/// Appends the lower bytes of a number, the lowest first.
inline void append_bytes(std::uint64_t number, std::size_t count, std::vector<std::uint8_t>& out) {
  for (std::size_t byte = 0; byte < count; ++byte)
    out.push_back(static_cast<std::uint8_t>(number >> (8 * byte)));
}
/// The inverse, for up to eight bytes.
inline std::uint64_t number_in(std::span<const std::uint8_t> bytes) {
  std::uint64_t number = 0;
  for (std::size_t byte = 0; byte < bytes.size(); ++byte) number |= std::uint64_t{bytes[byte]} << (8 * byte);
  return number;
}

}  // namespace tagrid
