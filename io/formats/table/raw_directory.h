#pragma once

#include <memory>
#include <string>

#include "io/formats/table/formats.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// Opens a directory of samples without headers: equally many slices in each file, in the order of the
/// numbers in their names. Throws BrokenInput if files are missing or have other sizes, and UsageError if
/// there are several series and none is chosen. REQUIRES: source.raw.
std::unique_ptr<VolumeSource> open_raw_directory(const std::string& folder, const SourceDescription& source);

}  // namespace tagrid
