// The values of a brick that has few different ones: a table in ascending order, as bytes and back. Samples are
// then numbers of its entries.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/sample/status.h"

namespace tagrid {

/// The most entries of a table for this number of samples: numbers have 16 bits, and a table pays only if each
/// of its entries is used a few times.
constexpr std::size_t most_entries(std::size_t samples) {
  const std::size_t quarter = samples / 4;
  return quarter < 2 ? 2 : quarter > 65536 ? 65536 : quarter;
}

/// Appends a table. Integers are multiples of a common step apart. Floats are near a progression
/// origin + step * k if that makes them shorter; what the arithmetic of the progression misses is stored.
/// REQUIRES: 2 .. 65536 values, whose keys (numbers.h) ascend.
template <class T>
void append_table(std::span<const T> values, std::vector<std::uint8_t>& out);

/// The inverse: takes a table from the beginning of `bytes`. Safe on any bytes. `samples`: those of the brick.
template <class T>
Status take_table(std::span<const std::uint8_t>& bytes, std::size_t samples, std::vector<T>& values);

/// The heap that append_table() takes, for values of this many bytes.
std::uint64_t working_bytes_of_encoding_table(std::size_t entries, std::size_t bytes);

}  // namespace tagrid
