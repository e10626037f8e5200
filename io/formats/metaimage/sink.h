// Writes MetaImage volumes: .mha, and .mhd with .raw beside it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/volume/volume_sink.h"

namespace tagrid {

/// Writes header and samples to the file at `path`, or to the standard output for "-". Positions become those
/// of ITK: left-posterior-superior. Fields that a MetaImage source had come back.
std::unique_ptr<VolumeSink> create_mha(const std::string& path, const VolumeInfo& info,
                                       const SinkOptions& options);

/// Writes the header to `path`, and the samples to `samples_path` in the same folder.
std::unique_ptr<VolumeSink> create_mhd(const std::string& path, const std::string& samples_path,
                                       const VolumeInfo& info, const SinkOptions& options);

/// What MetaImage cannot keep of this volume, one sentence for each loss.
std::vector<std::string> lost_in_meta_image(const VolumeInfo& info);

}  // namespace tagrid
