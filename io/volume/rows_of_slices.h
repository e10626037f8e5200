// Reads any rows of a volume whose source reads only complete slices, or reads only in order.
#pragma once

#include <cstdint>
#include <memory>

#include "io/volume/volume_source.h"

namespace tagrid {

/// A source of any rows. It reads the entire slice that contains them. If this is not the next slice, the
/// source may have to read everything before it. So at most `kept` slices are kept, of which rows may be
/// wanted later: those of the stretch that is being read, which is a sequence of slices that become later and
/// later. Memory: that of `source`, one slice, and the ones that are kept. REQUIRES: source->traits().again.
std::unique_ptr<VolumeSource> rows_of_slices(std::unique_ptr<VolumeSource> source, std::int64_t kept = 0);

}  // namespace tagrid
