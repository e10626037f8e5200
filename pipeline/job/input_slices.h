// Reads slices of the input for the flow graph.
#pragma once

#include <functional>

#include "io/volume/volume_source.h"
#include "pipeline/grid/slices.h"

namespace tagrid {

/// Reads `rows`, complete rows of one slice; see VolumeSource. Bytes after the last sample make the entire
/// input wrong, so they are checked before anything is finished.
SliceSamples read_input_slice(VolumeSource& source, const Box& rows);

/// A function that reads any rows in this way. `source` must outlive it.
inline std::function<SliceSamples(const Box& rows)> slices_of(VolumeSource& source) {
  return [&source](const Box& rows) { return read_input_slice(source, rows); };
}

}  // namespace tagrid
