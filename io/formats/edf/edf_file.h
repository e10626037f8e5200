// EDF, the ESRF data format: headers of names and values in braces, each followed by the samples of a frame.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// True for a brace with one of the names that such headers have.
bool begins_edf(std::string_view bytes);

/// Reads a file that was opened at `path` and is at its beginning. A file of several frames is a volume of so
/// many slices; of a single frame, Dim_3 counts slices. Throws BrokenInput, UsageError and WorldError.
std::unique_ptr<VolumeSource> open_edf(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source);

/// Reads a directory of files of one slice each, in the order of the numbers in their names. Of several series,
/// source.series chooses one. Throws as above.
std::unique_ptr<VolumeSource> open_edf_folder(const std::string& folder, const SourceDescription& source);

}  // namespace tagrid
