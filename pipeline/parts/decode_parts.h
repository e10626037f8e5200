// A .tag file decoded by several processes, each of which writes its rows at their place in the one volume.
#pragma once

#include <string>

#include "pipeline/parts/part_work.h"
#include "pipeline/ranks/ranks.h"
#include "pipeline/run/run.h"

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

/// What decode_volume() does, with the same result, by all ranks together; from a file to a file. To be
/// called by rank 0; the others serve().
DecodeResult decode_by_ranks(Ranks& ranks, const std::string& input, const std::string& output,
                             VolumeFormat format, bool overwrite, const Resources& resources,
                             const Progress& progress = {},
                             const BeforeNaming<DecodeResult>& before_naming = {});

}  // namespace tagrid
