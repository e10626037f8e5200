// Volumes with a header of lines, before the samples or in a file of its own: NRRD and MetaImage.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

struct TextHeaderFormat {
  std::string_view name;       ///< "NRRD"
  std::size_t most_bytes = 0;  ///< Longer headers are refused.
  /// True for the last line of a header, which has its line end.
  bool (*is_last)(std::string_view line) = nullptr;
  /// The same header for the plain form of its volume.
  std::string (*plain)(std::string_view text) = nullptr;
};

/// Reads the lines of a header, up to its last one or the end of the file. Throws BrokenInput if it is too
/// long.
std::string read_header_text(FileBytes& file, const TextHeaderFormat& format);

/// The plain form of the file with the header at `path`: the header, and what follows it up to byte `end`;
/// nothing: the end of the file.
PlainFile plain_header(const std::string& path, const TextHeaderFormat& format,
                       std::optional<std::uint64_t> end);

/// Opens the samples of `facts` in a file, the last one of `facts`. `header_bytes` were read from another
/// one.
using OpenSamples = std::function<std::unique_ptr<VolumeSource>(
    std::unique_ptr<FileBytes> file, SourceFacts facts, std::uint64_t header_bytes)>;

/// The samples of `facts` in the files that the header at `path` names: equal parts of its slices.
/// `header_name` is for messages. Throws as require_inside() does.
std::unique_ptr<VolumeSource> open_data_files(const TextHeaderFormat& format, SourceFacts facts,
                                              const std::string& path, const std::string& header_name,
                                              std::uint64_t header_bytes,
                                              const std::vector<std::string>& data_files, bool outside_ok,
                                              const OpenSamples& open);

}  // namespace tagrid
