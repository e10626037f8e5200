// Reads any rows of a volume whose source reads only whole slices, or reads only in order.
#pragma once

#include <memory>

#include "io/volume/volume_source.h"

namespace tagrid {

/// A source of any rows. It reads the whole slice that contains them. If this is not the next slice, the
/// source may have to read everything before it. Memory: that of `source`, and one slice. REQUIRES:
/// source->traits().again.
std::unique_ptr<VolumeSource> rows_of_slices(std::unique_ptr<VolumeSource> source);

}  // namespace tagrid
