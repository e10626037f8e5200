// Plans how a volume is processed within the available memory: what is in flight, and in which strips.
//
// docs/design.md explains the sums (Memory). They are upper bounds: the memory of a brick was measured with
// noise, which needs the most.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "pipeline/memory/resources.h"
#include "stages/grid/brick_grid.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

struct EncodePlan {
  EncodeBudget budget;
  /// Rows of bricks that are encoded together. With all rows of a layer, no sample is read twice.
  std::int64_t rows = 1;
  /// The largest amount of memory that the process takes.
  std::uint64_t memory = 0;
  /// The samples must be spooled first.
  bool spooled = false;

  bool in_strips(const BrickGrid& bricks) const { return rows < bricks.bricks(1); }
  /// `part` cut into stretches that are encoded one after the other.
  std::vector<BrickRows> strips(const BrickGrid& bricks, const BrickRows& part) const;
};

/// How a volume is read.
struct Reading {
  bool any_rows = true;      ///< rows of slices in any order, without a spool
  std::uint64_t memory = 0;  ///< that reading takes, besides the samples of a plan
};

/// What takes memory besides the bricks of an encoding.
struct EncodeNeeds {
  std::uint64_t besides = 0;  ///< memory of the reader
  bool sums = false;          ///< blocks are summed for overviews
  std::optional<Reading> verified =
      {};  ///< the file will be compared with its original within the same limit
  /// The least memory that the process takes for something else when bricks no longer take any.
  std::uint64_t afterwards = 0;
};

/// The plan with the least reading, and then the most threads. It has complete layers, unless rows can be
/// read in any order (`random_access`) or be spooled. Throws UsageError, which names a sufficient limit, if
/// the limit cannot be kept.
EncodePlan plan_encoding(const CodingParameters& parameters, const Resources& resources,
                         bool random_access = true, const EncodeNeeds& needs = {});

/// How many slices besides those of the plan may be in memory: `most`, or what the limit leaves room for.
std::int64_t slices_beside(const CodingParameters& parameters, const EncodePlan& plan,
                           const Resources& resources, std::int64_t most);

/// The smallest limit that plan_encoding() can keep. `strips`: rows of slices can be read in any order.
std::uint64_t smallest_memory_of_encoding(const CodingParameters& parameters, bool strips,
                                          std::uint64_t besides = 0, bool sums = false);

/// The same for comparing a file. `strips`: rows of the original can be read in any order, or spooled.
std::uint64_t smallest_memory_of_verifying(const CodingParameters& parameters, bool strips,
                                           std::uint64_t besides = 0);

/// How decoded bricks are used.
enum class DecodeUse {
  write,          ///< Samples are written in any order.
  stream,         ///< Samples are written in raster order.
  verify,         ///< Grid, statistics and shared faces are checked, samples compared with rows in any order.
  verify_stream,  ///< The same, with rows in raster order.
  mesh,           ///< Complete layers are made into tetrahedra.
};

struct DecodePlan {
  DecodeBudget budget;
  std::uint64_t memory = 0;
  /// The ordered stream (the output or the original) goes through a file.
  bool spooled = false;
  /// Verifying computes the grid, which bricks do not have: there is memory for the layers that this takes.
  bool derives = false;
};

/// The plan with the largest pieces, and then the most threads. Throws as plan_encoding() does. `besides`:
/// memory of the writer, or of the reader of an original. `value_bytes`: see DecodeLoad.
DecodePlan plan_decoding(const CodingParameters& parameters, const Resources& resources,
                         DecodeUse use = DecodeUse::write, std::uint64_t besides = 0,
                         std::size_t value_bytes = 0);

/// Memory of the program and its libraries, and unused parts of the heap.
inline constexpr std::uint64_t memory_of_program = std::uint64_t{12} << 20;
/// A heap loses a little memory between its blocks.
inline constexpr double heap_overhead = 1.03;
/// `bytes` with that loss. A double, because the header of a damaged file may claim more than 2^64 bytes.
std::uint64_t with_heap_overhead(double bytes);

/// The amount of work that is in memory while rows of bricks are encoded.
struct EncodeLoad {
  std::int64_t threads = 1, rows = 1, slices_ahead = 0, bricks_in_flight = 1;
  bool sums = false;  ///< of blocks, for overviews
};
std::uint64_t memory_of_encoding(const CodingParameters& parameters, const EncodeLoad& load);

/// The same for decoding. `inspect`: grids and shared faces are checked. `with_grid`: the caller gets grids.
struct DecodeLoad {
  std::int64_t threads = 1, rows = 1, bricks_in_flight = 1;
  bool inspect = false, with_grid = false;
  std::size_t value_bytes = 0;  ///< of each value that samples become; 0: they stay as they are
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
