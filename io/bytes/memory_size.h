// Sizes in files have 64 bits; those in memory may have fewer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>

namespace tagrid {

/// Converts a number of bytes or entries to a size in memory, for allocations. Throws std::length_error, as
/// containers do, if this machine cannot address so much. `Size` is another type only in tests.
template <class Size = std::size_t>
constexpr Size memory_size(std::uint64_t size) {
  if (size > std::numeric_limits<Size>::max())
    throw std::length_error("a size is beyond the memory of this machine");
  return static_cast<Size>(size);
}

}  // namespace tagrid
