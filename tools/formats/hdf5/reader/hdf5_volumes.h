// Volumes in HDF5 files: https://docs.hdfgroup.org/hdf5
#pragma once

#include <memory>
#include <string>

#include "io/programs/serve_reader.h"

namespace tagrid {

/// Opens a data set of three axes (z, y, x): the one that the option "dataset" names, otherwise the default one of NeXus,
/// otherwise the only one. See tools/formats/hdf5/reader/geometry.h for what gives its geometry.
std::unique_ptr<ServedVolume> open_hdf5(const std::string& path, const ReaderOptions& options);

}  // namespace tagrid
