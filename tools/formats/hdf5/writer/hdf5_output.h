// Volumes as data sets of HDF5 files, and of VTKHDF files.
#pragma once

#include <memory>

#include "io/programs/serve_writer.h"

namespace tagrid {

/// Begins a file: of VTKHDF if the option "format" is "vtkhdf", otherwise with the data set /volume. The samples (z, y, x) are
/// in one piece of the file, so that they can be read in place. The data set has the attributes of
/// tools/formats/hdf5/description.h.
std::unique_ptr<ServedOutput> begin_hdf5(const WriteRequest& request);

}  // namespace tagrid
