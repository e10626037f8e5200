// Volumes in TIFF files and in folders of them.
#pragma once

#include <memory>
#include <string>

#include "io/programs/serve_reader.h"

namespace tagrid {

/// Opens a file, or a folder: of slices by the numbers in their names, of files that are volumes by
/// themselves, and of sets whose OME-XML names their files. Of several volumes, the option "series" chooses
/// one. Throws BrokenInput, UsageError, WorldError, SeveralVolumes.
std::unique_ptr<ServedVolume> open_tiff(const std::string& path, const ReaderOptions& options);

}  // namespace tagrid
