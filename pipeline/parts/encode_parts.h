// A volume encoded in parts: by several processes, and so that a run that was interrupted goes on where it
// was.
#pragma once

#include <optional>
#include <string>

#include "pipeline/ranks/ranks.h"
#include "pipeline/run/run.h"

namespace tagrid {

struct PartsOptions {
  /// Go on with the run that `.NAME.parts/` beside the output is the record of, or begin one that can be
  /// continued. Without, nothing is left of a run that fails.
  bool resume = false;
  /// Who encodes, with its version: another one may make other bytes.
  std::string program;
  /// Of each rank; with 0 threads: as many as it may run on.
  Resources resources{0};
  /// Told once, where an earlier run is gone on with: how many of its parts are there.
  std::function<void(std::int64_t there, std::int64_t parts)> goes_on = {};
};

/// Whether that can be done: from a file to a file.
bool parts_are_possible(const std::string& input, const std::string& output);

/// What encode_volume() does, with the same result, in parts that all ranks make together. To be called by
/// rank 0; the others serve(). Throws UsageError also where a run cannot be continued, and says why: other
/// settings, another input, or another process that is at it.
EncodeResult encode_in_parts(Ranks& ranks, const std::string& input, const SourceDescription& source,
                             const std::string& output, bool overwrite, const EncodeOptions& options,
                             const PartsOptions& parts, const Progress& progress = {},
                             const BeforeNaming<EncodeResult>& before_naming = {});

}  // namespace tagrid
