// Bytes that the values of a brick carry for its activity.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace tagrid {

/// The states of the lanes begin with any number of 16 bits, so they can carry bytes that take no room. They are asked for
/// at most once, when the reconstruction of the brick is complete, and must last until the brick is encoded. If they are
/// fewer than there is room for, none is carried.
using BytesToCarry = std::function<std::span<const std::uint8_t>()>;

/// What became of them.
struct Carrying {
  bool asked = false;     ///< they were asked for, and the reconstruction has not changed since
  std::size_t count = 0;  ///< of those that are carried, the first ones
};

}  // namespace tagrid
