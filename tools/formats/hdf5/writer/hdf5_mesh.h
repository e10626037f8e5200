// A mesh as an unstructured grid in a VTKHDF file.
#pragma once

#include <memory>

#include "io/programs/serve_writer.h"

namespace tagrid {

/// Begins the file. Throws UsageError if it should have another format, and WorldError.
std::unique_ptr<ServedMesh> begin_hdf5_mesh(const WriteMeshRequest& request);

}  // namespace tagrid
