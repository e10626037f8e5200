// Which of several volumes in one array is meant.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/formats/zarr/reader/image.h"

namespace tagrid {

/// The number along each axis of the volume that `wanted` names; along x, y and z, 0. `path` is for messages. Throws
/// SeveralVolumes, UsageError, BrokenInput.
std::vector<std::int64_t> chosen_volume(const std::string& path, const ZarrImage& image,
                                        const std::string& wanted);

}  // namespace tagrid
