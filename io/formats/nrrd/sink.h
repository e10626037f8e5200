// Writes volumes to NRRD files, attached or detached, and to files of samples alone.
#pragma once

#include <memory>
#include <string>

#include "io/volume/volume_sink.h"

namespace tagrid {

/// Writes the header and the samples to the file at `path`, or to the standard output for "-".
std::unique_ptr<VolumeSink> create_nrrd(const std::string& path, const VolumeInfo& info,
                                        const SinkOptions& options);

/// Writes the header to `path`, and the samples to `samples_path` in the same folder. Throws UsageError if a
/// header cannot name that file.
std::unique_ptr<VolumeSink> create_nhdr(const std::string& path, const std::string& samples_path,
                                        const VolumeInfo& info, const SinkOptions& options);

/// Writes the samples alone.
std::unique_ptr<VolumeSink> create_raw(const std::string& path, const VolumeInfo& info,
                                       const SinkOptions& options);

}  // namespace tagrid
