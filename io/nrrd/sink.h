// Volumes to NRRD files, attached or detached, and to files of samples alone.
#pragma once

#include <memory>
#include <string>

#include "io/volume/volume_sink.h"

namespace tagrid {

/// The header and the samples in the file at `path`, or on the standard output for "-".
std::unique_ptr<VolumeSink> create_nrrd(const std::string& path, const VolumeInfo& info,
                                        const SinkOptions& options);

/// The header at `path`, and the samples at `samples_path`, in the same folder. Throws UsageError where a
/// header cannot name that file.
std::unique_ptr<VolumeSink> create_nhdr(const std::string& path, const std::string& samples_path,
                                        const VolumeInfo& info, const SinkOptions& options);

/// The samples alone.
std::unique_ptr<VolumeSink> create_raw(const std::string& path, const VolumeInfo& info,
                                       const SinkOptions& options);

}  // namespace tagrid
