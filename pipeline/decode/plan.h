// Plans how bricks are decoded within the available memory.
#pragma once

#include <cstddef>
#include <cstdint>

#include "pipeline/memory/resources.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// How decoded bricks are used.
enum class DecodeUse {
  write,          ///< Samples are written in any order.
  stream,         ///< Samples are written in raster order.
  verify,         ///< Bricks are checked, and samples compared with rows in any order.
  verify_stream,  ///< The same, with rows in raster order.
  mesh,           ///< Complete layers are made into tetrahedra.
};

/// The amount of work that is in memory while rows of bricks are decoded.
struct DecodeLoad {
  std::int64_t threads = 1, rows = 1, bricks_in_flight = 1;
  bool with_grid = false;       ///< grids are decoded, or derived where bricks have none
  std::size_t value_bytes = 0;  ///< of each value that samples become; 0: they stay as they are
  /// The most memory of what takes the bricks and rows; nullptr: it keeps nothing.
  double (*kept)(const CodingParameters& parameters, const DecodeLoad& load) = nullptr;
};
std::uint64_t memory_of_decoding(const CodingParameters& parameters, const DecodeLoad& load);

struct DecodePlan {
  DecodeBudget budget;
  std::uint64_t memory = 0;
  /// The ordered stream (the output or the original) goes through a file.
  bool spooled = false;
  /// Verifying computes the grid, which bricks do not have: there is memory for the layers that this takes.
  bool derives = false;
};

/// The plan with the largest pieces, and then the most threads. Throws as plan_encoding() does. `besides`:
/// memory of the writer, or of the reader of an original. `value_bytes`, `kept`: see DecodeLoad.
DecodePlan plan_decoding(const CodingParameters& parameters, const Resources& resources,
                         DecodeUse use = DecodeUse::write, std::uint64_t besides = 0,
                         std::size_t value_bytes = 0, decltype(DecodeLoad::kept) kept = nullptr);

/// The memory of bricks that are read one by one, by threads that store samples and grids elsewhere.
std::uint64_t memory_of_reading(const CodingParameters& parameters, std::int64_t threads,
                                bool with_grid = false);

}  // namespace tagrid
