// All volumes of a file whose reader gives them one by one.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "io/volume/volume_source.h"

namespace tagrid {

/// Opens the volume with a name.
using OpenByName = std::function<std::unique_ptr<VolumeSource>(const std::string& name)>;

/// The volumes of the file at `path` with these names, as VolumeInfo::volumes. They are opened one after the
/// other, each once to describe it, and again when its turn comes. Throws UsageError if they are not of one
/// size, type and scale.
std::unique_ptr<VolumeSource> all_volumes(const std::string& path, const std::vector<std::string>& names,
                                          const OpenByName& open);

}  // namespace tagrid
