// How a volume is worked on within the memory that there is: what is in flight, and in which strips.
#pragma once

#include <cstdint>
#include <vector>

#include "grid/coding_parameters.h"
#include "pipeline/brick_rows.h"
#include "pipeline/decode_graph.h"
#include "pipeline/encode_graph.h"

namespace tagrid {

struct EncodePlan {
  EncodeBudget budget;
  /// Rows of bricks that are encoded together; all rows of a layer: then layers follow one another, and no
  /// sample is read twice.
  std::int64_t rows = 1;

  /// `part` cut into stretches that are encoded one after the other.
  std::vector<BrickRows> strips(const BrickGrid& bricks, const BrickRows& part) const;
};

/// The plan that needs the least reading on `threads` threads.
EncodePlan plan_encoding(const CodingParameters& parameters, int threads);

struct DecodePlan {
  DecodeBudget budget;
};

/// The plan that writes the largest pieces on `threads` threads.
DecodePlan plan_decoding(const CodingParameters& parameters, int threads);

}  // namespace tagrid
