// What is asked of the encoding of a volume, and what comes of it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "io/tag/header.h"
#include "io/tag/index.h"
#include "io/volume/volume_info.h"
#include "pipeline/encode/options.h"
#include "pipeline/memory/finished.h"
#include "pipeline/memory/progress.h"
#include "pipeline/memory/resources.h"

namespace tagrid {

struct EncodeRun {
  std::string input;  ///< "-": the standard input
  SourceDescription source = {};
  std::string output;  ///< "-": the standard output
  bool overwrite = false;
  EncodeOptions options = {};
  Resources resources{0};  ///< of each rank; 0 threads: as many as it may run on
  Progress progress = {};

  /// Go on with the run that `.NAME.parts/` beside the output is the record of, or begin one that can be
  /// continued. Without, nothing is left of a run that fails.
  bool resume = false;
  /// Who encodes, with its version: another one may make other bytes. For the record.
  std::string program = {};
  /// Told once, where an earlier run is gone on with: how many of its parts are there.
  std::function<void(std::int64_t there, std::int64_t parts)> goes_on = {};
};

struct EncodeResult {
  TagHeader header;
  TagIndex index;
  std::uint64_t bytes_in = 0;    ///< read, headers included
  std::uint64_t file_bytes = 0;  ///< written
  std::string temporary;         ///< where the file is before it gets its name; "" for pipes and devices
  std::uint64_t memory = 0;      ///< that the plan takes at most
  double times_read = 0;         ///< how often a sample was read to be encoded, on average
};

using FinishedEncode = Finished<EncodeResult>;

}  // namespace tagrid
