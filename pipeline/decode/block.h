// Decodes one block of a file.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "io/tag/blocks.h"
#include "io/tag/index.h"
#include "pipeline/grid/value_range.h"
#include "stages/brick/decode.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// The brick of a block. Throws BrokenInput if it cannot be decoded; the message begins with `name`, that of
/// the file, unless it is "". `slices`: see BrickRequest.
DecodedBrick decode_block(const BrickBytes& block, const CodingParameters& parameters,
                          const std::string& name, Wanted wanted, std::int64_t slices = all_slices);

/// True if the decoded samples of a brick can have this range, by its entry in the index and the largest error that the
/// index records.
inline bool can_be_of(const ValueRange& range, const IndexEntry& brick, double max_error) {
  // Without finite samples both are infinite, and their difference is a NaN.
  return !(std::abs(range.low - brick.low) > max_error || std::abs(range.high - brick.high) > max_error);
}

}  // namespace tagrid
