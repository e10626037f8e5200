// NIfTI volumes: .nii, .nii.gz, and pairs of .hdr and .img.
#pragma once

#include <memory>
#include <string>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// Reads a NIfTI file, or the pair to which a header belongs. `file` was opened at `path` and is at its
/// beginning; it may be compressed with gzip. `source.series` chooses one of several volumes by its number,
/// counted from 1. Throws BrokenInput, UsageError and WorldError.
std::unique_ptr<VolumeSource> open_nifti(std::unique_ptr<FileBytes> file, const std::string& path,
                                         const SourceDescription& source);

}  // namespace tagrid
