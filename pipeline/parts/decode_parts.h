// A .tag file decoded by several processes, each of which writes its rows at their place in the one volume.
#pragma once

#include <string>

#include "pipeline/parts/part_work.h"
#include "pipeline/ranks/ranks.h"

namespace tagrid {

struct DecodeOrder {
  std::string input;
  std::string file;         ///< that the samples are written into, and that gets its name later
  std::string name;         ///< its name, for messages
  std::uint64_t start = 0;  ///< where the samples begin there
  Resources resources{0};   ///< of each rank; 0 threads: as many as it may run on
};

/// Collective. Decodes the parts and writes their samples.
void decode_parts(Ranks& ranks, const DecodeOrder& order, const Progress& progress = {});

}  // namespace tagrid
