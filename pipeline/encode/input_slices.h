// Slices of the input, as the flow graph takes them.
#pragma once

#include "io/volume/volume_source.h"
#include "pipeline/encode/slices.h"

namespace tagrid {

/// Reads `rows`, whole rows of one slice: see VolumeSource. What follows the last sample makes the whole input
/// wrong, so it is looked at before anything is finished.
SliceSamples read_input_slice(VolumeSource& source, const Box& rows);

}  // namespace tagrid
