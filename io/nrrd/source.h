// Volumes from NRRD files (attached, detached, raw or gzip) and from headerless files.
#pragma once

#include <memory>
#include <string>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// `file` was opened at `path`, and stands where its NRRD header begins. Where `source.raw` is given, it must
/// agree with the header: another size is BrokenInput, another type, spacing or order of bytes UsageError.
std::unique_ptr<VolumeSource> open_nrrd(std::unique_ptr<FileBytes> file, const std::string& path,
                                        const SourceDescription& source);

/// A file that says nothing of itself. REQUIRES: source.raw.
std::unique_ptr<VolumeSource> open_raw(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source);

}  // namespace tagrid
