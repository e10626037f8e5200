// Any rows of a volume that is otherwise read in whole slices, or in order only.
#pragma once

#include <memory>

#include "io/volume/volume_source.h"

namespace tagrid {

/// A source of any rows, which reads the whole slice that they are in, and what precedes it where that is not
/// the next one. Its memory is that of `source` and one slice. REQUIRES: source->traits().again.
std::unique_ptr<VolumeSource> rows_of_slices(std::unique_ptr<VolumeSource> source);

}  // namespace tagrid
