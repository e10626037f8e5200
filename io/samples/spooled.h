// A volume that can be read in any order because it was copied.
#pragma once

#include <memory>
#include <string>

#include "io/volume/volume_source.h"

namespace tagrid {

/// Copies all samples to an unnamed temporary file in `folder`, and returns a source that reads any rows from
/// it. All other facts about the volume stay the same. REQUIRES: nothing was read of `source`, or it was
/// rewound.
std::unique_ptr<VolumeSource> spooled(std::unique_ptr<VolumeSource> source, const std::string& folder);

}  // namespace tagrid
