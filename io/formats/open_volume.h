// Volumes from files of any format, and from pipes.
#pragma once

#include <memory>
#include <string>

#include "io/volume/volume_source.h"

namespace tagrid {

/// Opens the volume at `path`, or on the standard input for "-". What begins as an NRRD file is read as one
/// (unless `source.raw` has an offset), and must then agree with what `raw` says, if given: another size is
/// BrokenInput, another type, spacing or order of bytes UsageError. What begins as an OpenVDB file is read as
/// one, and must be a file. Anything else needs `raw`. The sizes of files are checked at once.
std::unique_ptr<VolumeSource> open_volume(const std::string& path, const SourceDescription& source = {});

}  // namespace tagrid
