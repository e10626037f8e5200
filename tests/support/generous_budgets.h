// Budgets with which no thread waits for memory.
#pragma once

#include "pipeline/decode/graph.h"
#include "pipeline/encode/graph.h"

namespace tagrid {

/// Reads ahead while a layer is encoded: as many slices as the next layer adds.
inline EncodeBudget generous_encoding(const CodingParameters& parameters, int threads) {
  return {threads, parameters.bricks().length(), 16 * std::int64_t{threads}};
}

/// Writes whole layers.
inline DecodeBudget generous_decoding(const CodingParameters& parameters, int threads) {
  return {threads, 16 * std::int64_t{threads}, parameters.bricks().bricks(1)};
}

}  // namespace tagrid
