// Reads slices of the input for the flow graph.
#pragma once

#include "io/volume/volume_source.h"
#include "pipeline/encode/slices.h"

namespace tagrid {

/// Reads `rows`, whole rows of one slice; see VolumeSource. Bytes after the last sample make the whole input
/// wrong, so they are checked before anything is finished.
SliceSamples read_input_slice(VolumeSource& source, const Box& rows);

}  // namespace tagrid
