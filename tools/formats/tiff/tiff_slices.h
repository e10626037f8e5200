// The slices of one of the volumes in TIFF files.
#pragma once

#include <memory>

#include "tools/formats/tiff/tiff_volumes.h"

namespace tagrid {

/// Volume `number` of `volumes`, which are not needed any more.
std::unique_ptr<ServedVolume> slices_of(TiffVolumes volumes, std::size_t number);

}  // namespace tagrid
