// MetaImage volumes: .mha, and .mhd with the samples in one file or several.
#pragma once

#include <memory>
#include <string>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// Reads the volume that a header describes. `file` was opened at `path` and is at its beginning. Of several volumes,
/// `source.series` chooses one by its number, from 1 on. Throws BrokenInput, UsageError and WorldError.
std::unique_ptr<VolumeSource> open_meta_image(std::unique_ptr<FileBytes> file, const std::string& path,
                                              const SourceDescription& source);

}  // namespace tagrid
