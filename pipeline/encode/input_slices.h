// Reads slices of the input for the flow graph.
#pragma once

#include "io/formats/volume_reader.h"
#include "pipeline/encode/slices.h"

namespace tagrid {

/// Reads `rows`, whole rows of one slice. Bytes after the last sample make the whole input wrong, so they are
/// checked before anything is finished. Without random access, the whole slice is read, and any slices before
/// it that have not been read.
SliceSamples read_input_slice(VolumeReader& reader, const Box& rows);

}  // namespace tagrid
