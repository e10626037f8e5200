// decode --rm: removes a .tag file only if the decoded volume holds everything that it holds.
#pragma once

#include <string>
#include <vector>

#include "io/formats/table/formats.h"
#include "pipeline/decode/values.h"
#include "tools/options/vdb_options.h"
#include "tools/options/wanted_region.h"

namespace tagrid {

/// How a .tag file is decoded, as far as something can be lost by it.
struct Decoding {
  const Format& format;
  const WantedRegion& wanted;
  const VdbOptions& vdb;
  Numbers numbers = Numbers::automatic;
};

/// The files that decode --rm will remove: the .tag file. Throws UsageError if it is not a file, if `output`
/// is not a file that stays, or if the output would hold less than the .tag file, with what would be lost;
/// BrokenInput; WorldError.
std::vector<std::string> replaced_tag(const std::string& input, const std::string& output,
                                      const Decoding& decoding);

}  // namespace tagrid
