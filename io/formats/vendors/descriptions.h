// VGStudio and Nikon: a text file describes samples that are in another file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// What a text says of a volume.
struct TextDescription {
  std::string path = {};       ///< of the text
  std::string data_path = {};  ///< of the samples
  std::string data_file = {};  ///< the name of their file, as the text has it
  Index3 dims = {};
  std::optional<SampleType> type = {};  ///< nothing: it follows from the size of the file
  std::uint64_t offset = 0;             ///< the byte of the file at which samples begin
  Geometry geometry = {};
  KeyValues pairs = {};
  std::vector<std::string> warnings = {}, not_understood = {};  ///< as in SourceFacts
};

/// Reads .vgi and .xtekct. `file` was opened at `path` and is at its beginning. They throw BrokenInput and
/// WorldError, and UsageError for the standard input if the text does not name the file of the samples.
TextDescription describe_vgi(FileBytes& file, const std::string& path);
TextDescription describe_xtekct(FileBytes& file, const std::string& path);

}  // namespace tagrid
