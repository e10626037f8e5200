// Decodes a .tag file with several processes. Each process writes its rows at their place in the one volume.
#pragma once

#include <string>

#include "pipeline/decode/values.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/ranks/ranks.h"

namespace tagrid {

struct DecodeOrder {
  std::string input;
  std::string file;         ///< the file that the samples are written into; it gets its name later
  std::string name;         ///< its final name, for messages
  std::uint64_t start = 0;  ///< the byte at which the samples begin
  WrittenNumbers numbers = {};
  Resources resources{0};  ///< per rank; 0 threads: all that the rank may use
};

/// Collective. Decodes the parts and writes their samples.
void decode_parts(Ranks& ranks, const DecodeOrder& order, const Progress& progress = {});

}  // namespace tagrid
