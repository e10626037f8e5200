// Plans how a volume is processed within the available memory: what is in flight, and in which strips.
//
// docs/dev/design.md explains the sums (Memory). They are upper bounds: the memory of a brick was measured with
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

/// How a file will be compared with its original.
struct Comparing {
  Reading original;
  /// smallest_memory_of_verifying()
  std::uint64_t (*smallest)(const CodingParameters& parameters, bool strips, std::uint64_t besides);
};

/// What takes memory besides the bricks of an encoding.
struct EncodeNeeds {
  std::uint64_t besides = 0;               ///< memory of the reader
  bool sums = false;                       ///< blocks are summed for overviews
  std::optional<Comparing> verified = {};  ///< what follows within the same limit
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

/// Memory of the program and its libraries, and unused parts of the heap.
inline constexpr std::uint64_t memory_of_program = std::uint64_t{12} << 20;
/// A heap loses a little memory between its blocks.
inline constexpr double heap_overhead = 1.03;
/// `bytes` with that loss. A double, because the header of a damaged file may claim more than 2^64 bytes.
std::uint64_t with_heap_overhead(double bytes);
/// The same with the program.
std::uint64_t memory_of_process(double bytes);

/// The number of bricks, even for the header of a damaged file.
double count_of_bricks(const CodingParameters& parameters);

/// Throws MemoryLimit for doing `what` with a volume.
[[noreturn]] void refuse_memory(const CodingParameters& parameters, const char* what,
                                const MemoryNeeds& needs);

/// The amount of work that is in memory while rows of bricks are encoded.
struct EncodeLoad {
  std::int64_t threads = 1, rows = 1, slices_ahead = 0, bricks_in_flight = 1;
  bool sums = false;  ///< of blocks, for overviews
};
std::uint64_t memory_of_encoding(const CodingParameters& parameters, const EncodeLoad& load);

}  // namespace tagrid
