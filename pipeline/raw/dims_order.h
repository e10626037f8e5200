// Checks whether the given order of the dimensions of a headerless file is plausible.
#pragma once

#include <optional>
#include <string>

#include "io/volume/volume_info.h"

namespace tagrid {

class FileBytes;

/// True if the file can seek, has as many bytes as `raw` says, and is read as samples without a header.
bool fits(FileBytes& file, const RawDescription& raw);

/// Another order of raw.dims that fits the file's samples far better: in the right order, neighbors along y
/// and z differ little. Nothing if there is no such order, if the file's size does not fit, if the file
/// cannot seek, or if it begins as an NRRD file. Reads a few hundred short stretches of the file.
std::optional<Index3> likelier_dims(const std::string& path, const RawDescription& raw);

}  // namespace tagrid
