// Sizes that files say have 64 bits; memory may have fewer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>

namespace tagrid {

/// A number of bytes or of entries as a size of memory, for what is allocated. Throws std::length_error, as containers do, if
/// no memory of this machine can be so large. `Size` is another type only in tests.
template <class Size = std::size_t>
constexpr Size memory_size(std::uint64_t size) {
  if (size > std::numeric_limits<Size>::max())
    throw std::length_error("a size is beyond the memory of this machine");
  return static_cast<Size>(size);
}

}  // namespace tagrid
