// Slices of the input, as the flow graph takes them.
#pragma once

#include "io/formats/volume_reader.h"
#include "pipeline/encode/slices.h"

namespace tagrid {

/// Reads `rows`, whole rows of one slice. What follows the last sample makes the whole input wrong, so it is
/// looked at before anything is finished. Of a file without random access all of the slice is read, and what
/// precedes it where that is not the next one.
SliceSamples read_input_slice(VolumeReader& reader, const Box& rows);

}  // namespace tagrid
