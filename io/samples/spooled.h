// A volume that can be read in any order because it was copied.
#pragma once

#include <memory>
#include <string>

#include "io/volume/volume_source.h"

namespace tagrid {

/// Copies all samples into a nameless file in `folder`, and gives a source of any rows that reads from there.
/// What else is known of the volume stays. REQUIRES: nothing was read of `source`, or rewind().
std::unique_ptr<VolumeSource> spooled(std::unique_ptr<VolumeSource> source, const std::string& folder);

}  // namespace tagrid
