// What it takes to work on bricks: bounds for any samples, in bytes.
#pragma once

#include <cstdint>

#include "stages/volume/coding_parameters.h"

namespace tagrid {

/// Of the program, its libraries, and what of the heap is not in use.
inline constexpr std::uint64_t memory_of_program = std::uint64_t{12} << 20;

/// How much is in memory while rows of bricks are encoded.
struct EncodeLoad {
  std::int64_t threads = 1, rows = 1, slices_ahead = 0, bricks_in_flight = 1;
};
std::uint64_t memory_of_encoding(const CodingParameters& parameters, const EncodeLoad& load);

/// The same for decoding. `inspect`: grids and shared faces are looked at.
struct DecodeLoad {
  std::int64_t threads = 1, rows = 1, bricks_in_flight = 1;
  bool inspect = false, mesh = false;
};
std::uint64_t memory_of_decoding(const CodingParameters& parameters, const DecodeLoad& load);

/// The same for bricks that are read one by one, each by a thread that puts its samples elsewhere.
std::uint64_t memory_of_reading(const CodingParameters& parameters, std::int64_t threads);

}  // namespace tagrid
