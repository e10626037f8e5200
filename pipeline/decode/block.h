// Decodes one block of a file.
#pragma once

#include <cstdint>
#include <string>

#include "io/tag/blocks.h"
#include "stages/brick/decode.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// The brick of a block. Throws BrokenInput if it cannot be decoded; the message begins with `name`, that of
/// the file, unless it is "". `slices`: see BrickRequest.
DecodedBrick decode_block(const BrickBytes& block, const CodingParameters& parameters,
                          const std::string& name, Wanted wanted, std::int64_t slices = all_slices);

}  // namespace tagrid
