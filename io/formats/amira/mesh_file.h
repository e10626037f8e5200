// AmiraMesh files of Amira and Avizo that hold a volume: a text that describes it, and the samples.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// How samples are stored after the text.
enum class AmiraEncoding { plain, zip, byte_runs };

struct AmiraHeader {
  VolumeInfo info;
  bool big_endian = false;
  AmiraEncoding encoding = AmiraEncoding::plain;
  std::string_view encoding_text = "";  ///< the place of the text that names it, as "(HxZip,123)"
  std::uint64_t encoded_bytes = 0;      ///< unless samples are plain
  std::vector<std::string> warnings = {};
};

/// Reads the text before the samples, up to the line with their number. Throws BrokenInput if it does not
/// describe one volume of scalars with uniform coordinates. Safe for any bytes.
AmiraHeader parse_amira_header(std::string_view text);

/// Reads a file that was opened at `path` and is at its beginning. Throws BrokenInput and WorldError.
std::unique_ptr<VolumeSource> open_amira(std::unique_ptr<FileBytes> file, const std::string& path,
                                         const SourceDescription& source);

}  // namespace tagrid
