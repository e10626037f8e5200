// How a volume is worked on within the memory that there is: what is in flight, and in which strips.
//
// The sums are those of the chapter on memory in docs/design.md. They are bounds for the worst samples there
// are, noise: what a brick takes was measured.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/memory/resources.h"
#include "stages/grid/brick_rows.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {

struct EncodePlan {
  EncodeBudget budget;
  /// Rows of bricks that are encoded together; all rows of a layer: then layers follow one another, and no
  /// sample is read twice.
  std::int64_t rows = 1;
  /// What the process takes at most.
  std::uint64_t memory = 0;
  /// The samples have to be spooled first.
  bool spooled = false;

  bool in_strips(const BrickGrid& bricks) const { return rows < bricks.bricks(1); }
  /// `part` cut into stretches that are encoded one after the other.
  std::vector<BrickRows> strips(const BrickGrid& bricks, const BrickRows& part) const;
};

/// The plan that needs the least reading, on as many threads as then fit. Whole layers, unless rows of a
/// slice can be read in any order: with `random_access`, or where they may be spooled. Throws UsageError,
/// which says what is enough, where the limit cannot be kept. `besides`: what the reader takes for itself.
EncodePlan plan_encoding(const CodingParameters& parameters, const Resources& resources,
                         bool random_access = true, std::uint64_t besides = 0);

/// The smallest limit on memory that plan_encoding() can keep. `strips`: rows of a slice can be read in any
/// order.
std::uint64_t smallest_memory_of_encoding(const CodingParameters& parameters, bool strips,
                                          std::uint64_t besides = 0);

/// What is done with bricks that are decoded.
enum class DecodeUse {
  write,          ///< Samples are written in any order.
  stream,         ///< Samples are written in raster order.
  verify,         ///< Grid, statistics and shared faces are checked, samples compared with rows in any order.
  verify_stream,  ///< The same, with rows in raster order.
  mesh,           ///< Whole layers are made into tetrahedra.
};

struct DecodePlan {
  DecodeBudget budget;
  std::uint64_t memory = 0;
  /// What has an order, what is written or the original, goes through a file.
  bool spooled = false;
};

/// The plan that writes the largest pieces, on as many threads as then fit. Throws as plan_encoding() does.
/// `besides`: what the writer, or the reader of an original, takes for itself.
DecodePlan plan_decoding(const CodingParameters& parameters, const Resources& resources,
                         DecodeUse use = DecodeUse::write, std::uint64_t besides = 0);

}  // namespace tagrid
