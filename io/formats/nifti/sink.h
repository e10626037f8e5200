// Writes NIfTI volumes: .nii and .nii.gz.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/volume/volume_sink.h"

namespace tagrid {

/// Writes header and samples to the file at `path`, or to the standard output for "-": NIfTI-1, or NIfTI-2 if
/// a size is above 32767. Positions become those of right-anterior-superior. Fields that a NIfTI source had
/// come back.
std::unique_ptr<VolumeSink> create_nifti(const std::string& path, const VolumeInfo& info,
                                         const SinkOptions& options);

/// The same in gzip, which can only be written in order.
std::unique_ptr<VolumeSink> create_nifti_gz(const std::string& path, const VolumeInfo& info,
                                            const SinkOptions& options);

/// What NIfTI cannot keep of this volume, one sentence for each loss.
std::vector<std::string> lost_in_nifti(const VolumeInfo& info);

}  // namespace tagrid
