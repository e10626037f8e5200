// Encodes one volume of a manifest, verifies the output and describes it.
#pragma once

#include <atomic>
#include <nlohmann/json.hpp>

#include "tools/archive/conversion.h"
#include "tools/archive/late_syncs.h"
#include "tools/archive/records.h"

namespace tagrid {

/// What the lines of a run have in common.
struct EncodingPass {
  const ConversionOptions& options;
  const Resources resources;
  KnownOutputs& known;
  const std::atomic<bool>& stop;  ///< If it becomes true, no result is needed: encode_line() throws Stopped.
  ListMeter& meter;
  LateSyncs& syncs;
};

/// Encodes the volume of `line`, and gives the output its name after it was decoded and compared. Skips this
/// if a record or an existing output shows that it is not necessary. Adds the result to `record`. If it
/// throws, nothing new is left under the name of the output.
void encode_line(const EncodingPass& pass, const ManifestLine& line, nlohmann::ordered_json& record);

}  // namespace tagrid
