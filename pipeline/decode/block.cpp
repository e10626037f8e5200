#include "pipeline/decode/block.h"

#include "io/errors/errors.h"

namespace tagrid {

DecodedBrick decode_block(const BrickBytes& block, const CodingParameters& parameters,
                          const std::string& name, Wanted wanted, std::int64_t slices) {
  DecodedBrick brick;
  const Status status =
      decode_brick({block.activity, block.values}, parameters, {block.id, wanted, slices}, brick);
  if (!status.ok())
    throw BrokenInput((name.empty() ? "" : name + ": ") + "brick " + std::to_string(block.id) + ": " +
                      status.what());
  return brick;
}

}  // namespace tagrid
