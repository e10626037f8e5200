// The memory that work on bricks takes: upper bounds for any samples, in bytes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// Memory of the program and its libraries, and unused parts of the heap.
inline constexpr std::uint64_t memory_of_program = std::uint64_t{12} << 20;
/// A heap loses a little memory between its blocks.
inline constexpr double heap_overhead = 1.03;
/// `bytes` on the heap, of which the header of a damaged file may make any number, with that loss.
std::uint64_t with_heap_overhead(double bytes);

/// The amount of work that is in memory while rows of bricks are encoded.
struct EncodeLoad {
  std::int64_t threads = 1, rows = 1, slices_ahead = 0, bricks_in_flight = 1;
};
std::uint64_t memory_of_encoding(const CodingParameters& parameters, const EncodeLoad& load);

/// The same for decoding. `inspect`: grids and shared faces are checked. `with_grid`: the caller gets grids.
struct DecodeLoad {
  std::int64_t threads = 1, rows = 1, bricks_in_flight = 1;
  bool inspect = false, with_grid = false;
  std::size_t value_bytes =
      0;  ///< of each value that samples become before they are gathered; 0: they stay as they are
};
std::uint64_t memory_of_decoding(const CodingParameters& parameters, const DecodeLoad& load);

/// The memory, besides that of the program, of deriving the grid of complete layers of bricks.
std::uint64_t memory_of_deriving(const CodingParameters& parameters, std::int64_t threads);

/// The same for bricks that are read one by one, by threads that store samples and grids elsewhere.
std::uint64_t memory_of_reading(const CodingParameters& parameters, std::int64_t threads,
                                bool with_grid = false);

/// The same for estimating: each thread encodes and decodes bricks by themselves, with all that is around
/// them. `bounds` are tried on `chosen` bricks; all bricks are looked at.
std::uint64_t memory_of_estimating(const CodingParameters& parameters, std::int64_t threads,
                                   std::int64_t bounds, std::int64_t chosen);

}  // namespace tagrid
