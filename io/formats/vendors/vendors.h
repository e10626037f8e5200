// Volumes of scanners' own programs: samples that lie plainly in a file, and a description of them.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

// All functions to open read a description or a volume that was opened at `path`, and is at its beginning. It
// must be a regular file. They throw BrokenInput, UsageError and WorldError.

/// VGStudio: .vgi describes a .vol file.
bool begins_vgi(std::string_view bytes);
std::unique_ptr<VolumeSource> open_vgi(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source);

/// Nikon (X-Tek): .xtekct describes a .vol file of the same name. The size of that file says the type of its
/// samples.
bool begins_xtekct(std::string_view bytes);
std::unique_ptr<VolumeSource> open_xtekct(std::unique_ptr<FileBytes> file, const std::string& path,
                                          const SourceDescription& source);

/// PyHST, of the ESRF: a file a.vol.info describes a.vol. Samples are float32, unless it or the size of that file
/// says otherwise.
bool begins_pyhst(std::string_view bytes);
std::unique_ptr<VolumeSource> open_pyhst(std::unique_ptr<FileBytes> file, const std::string& path,
                                         const SourceDescription& source);

/// VFF, as scanners of GE write it: a header, and the samples.
inline constexpr std::string_view vff_magic = "ncaa";
std::unique_ptr<VolumeSource> open_vff(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source);

/// Scanco: .isq has header and samples. Values are linear attenuations in 1/cm.
bool begins_isq(std::string_view bytes);
std::unique_ptr<VolumeSource> open_isq(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source);

}  // namespace tagrid
