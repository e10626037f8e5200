// Volumes of DICOM files: one file, a folder, or a DICOMDIR.
#pragma once

#include <memory>
#include <string>

#include "io/programs/serve_reader.h"

namespace tagrid {

/// Opens the volume at `path`. Of several series, the option "series" chooses one by its UID or its number. Values with a
/// slope of 1 are given as they are meant (Hounsfield units), if 16 bits hold them; others as they are stored.
std::unique_ptr<ServedVolume> open_dicom(const std::string& path, const ReaderOptions& options);

}  // namespace tagrid
