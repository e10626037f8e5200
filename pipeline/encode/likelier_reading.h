// A second thought on the type and the order of bytes that were said of a headerless file.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "io/volume/volume_info.h"

namespace tagrid {

/// Another reading of the same bytes.
struct LikelierReading {
  std::size_t sample_bytes = 0;
  /// Which of the readings with samples of this size; where the size is another one than was said, only the
  /// size is sure.
  SampleType type = SampleType::uint8;
  bool big_endian = false;
};

/// A reading that fits the file's samples far better than the one that was said: neighbours along x differ
/// little in the right one, while bytes in the wrong order, halves of samples, or pairs of them look like
/// noise. Nothing where there is none, where the file is nearly constant or small, where its size does not
/// fit, and for what cannot seek or begins as an NRRD file. Reads at most 64 short stretches of the file.
std::optional<LikelierReading> likelier_reading(const std::string& path, const RawDescription& raw);

}  // namespace tagrid
