// Volumes from NRRD files (attached, detached, raw, gzip or bzip2) and from headerless files.
#pragma once

#include <memory>
#include <string>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// `file` was opened at `path`, and is at the beginning of its NRRD header. If `source.raw` is given, it must
/// agree with the header: a different size is BrokenInput; a different type, spacing or byte order is
/// UsageError.
std::unique_ptr<VolumeSource> open_nrrd(std::unique_ptr<FileBytes> file, const std::string& path,
                                        const SourceDescription& source);

/// A file without a header. REQUIRES: source.raw.
std::unique_ptr<VolumeSource> open_raw(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source);

}  // namespace tagrid
