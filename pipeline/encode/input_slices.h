// Slices of the input, as the flow graph takes them.
#pragma once

#include <functional>

#include "io/formats/volume_reader.h"
#include "pipeline/encode/slices.h"

namespace tagrid {

/// Reads `rows`, whole rows of one slice. What follows the last sample makes the whole input wrong, so it is
/// looked at before anything is finished. Of a file without random access all of the slice is read, and what
/// precedes it where that is not the next one.
SliceSamples read_input_slice(VolumeReader& reader, const Box& rows);

/// The same of any rows of `reader`, which outlives what is returned.
inline std::function<SliceSamples(const Box& rows)> slices_of(VolumeReader& reader) {
  return [&reader](const Box& rows) { return read_input_slice(reader, rows); };
}

}  // namespace tagrid
