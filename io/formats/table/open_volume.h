// Volumes from files of any format, and from pipes.
#pragma once

#include <ctime>
#include <memory>
#include <string>

#include "io/formats/table/formats.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// Opens the volume at `path`, or on the standard input for "-". A file that begins as an NRRD file is read
/// as NRRD (unless `source.raw` has an offset). It must then agree with `raw`, if given: a different size is
/// BrokenInput; a different type, spacing or byte order is UsageError. A file that begins as an OpenVDB file
/// is read as OpenVDB; it must be a regular file, not a pipe. Files of other known formats, and directories
/// of them, are read by reader programs (docs/dev/readers.md). Anything else needs `raw`, or a reader that has
/// the name of the file's extension. `source.from` names the format instead. File sizes are checked at once.
std::unique_ptr<VolumeSource> open_volume(const std::string& path, const SourceDescription& source = {});

/// What SourceDescription::known can be of a volume that was opened at this time; nothing if it must be described
/// again: if its samples do not lie plainly in files, or if a file was changed so shortly before that it may have
/// been changed while it was described. Throws WorldError.
std::shared_ptr<const KnownVolume> known_volume(const VolumeSource& volume, std::time_t opened);

/// The format of a file that can be read, by its content, or by its name if a program reads it; nullptr if it
/// has none of these. Throws WorldError.
const Format* readable_format(const std::string& path);

/// Opens a directory of samples without headers: equally many slices in each file, in the order of the
/// numbers in their names. Throws BrokenInput if files are missing or have other sizes, and UsageError if
/// there are several series and none is chosen. REQUIRES: source.raw.
std::unique_ptr<VolumeSource> open_raw_directory(const std::string& folder, const SourceDescription& source);

}  // namespace tagrid
