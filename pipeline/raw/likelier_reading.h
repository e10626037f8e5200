// Checks whether the given type, byte order and dimensions of a headerless file are plausible.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "io/volume/volume_info.h"

namespace tagrid {

/// A different reading of the same bytes.
struct LikelierReading {
  std::size_t sample_bytes = 0;
  /// One of the readings with samples of this size. If the size is not the given one, only it is certain.
  SampleType type = SampleType::uint8;
  bool big_endian = false;
};

/// A reading that fits the samples far better than the given one. In the right one, neighbors along x differ
/// little; bytes in the wrong order, halves and pairs of samples look like noise, and values of the other
/// sign lie at both ends of the type. Nothing if there is none, or if the file is nearly constant, small, of
/// another size, cannot seek, or begins as an NRRD file. Reads at most 64 short stretches.
std::optional<LikelierReading> likelier_reading(const std::string& path, const RawDescription& raw);

class FileBytes;

/// True if the file can seek, has as many bytes as `raw` says, and is read as samples without a header.
bool fits(FileBytes& file, const RawDescription& raw);

/// Another order of raw.dims that fits the file's samples far better: in the right order, neighbors along y
/// and z differ little. Nothing if there is no such order, if the file's size does not fit, if the file
/// cannot seek, or if it begins as an NRRD file. Reads a few hundred short stretches of the file.
std::optional<Index3> likelier_dims(const std::string& path, const RawDescription& raw);

}  // namespace tagrid
