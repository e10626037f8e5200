// MetaImage headers, and volumes that have them. The format: https://itk.org/Wiki/ITK/MetaIO/Documentation
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/volume/volume_info.h"
#include "io/volume/volume_source.h"

namespace tagrid {

struct MetaImageHeader {
  /// One volume. Key-value pairs that begin with "metaimage_" have the fields that say nothing about how
  /// samples are stored. The space is that of ITK: left-posterior-superior.
  VolumeInfo info;
  bool big_endian = false;
  bool is_compressed = false;  ///< zlib
  std::int64_t volumes = 1;    ///< of a fourth axis, one after the other
  /// Relative to the directory of the header; none if the samples follow it. All have equally many slices.
  std::vector<std::string> data_files;
  /// Bytes to skip in each data file; -1: the samples are its last bytes.
  std::int64_t header_size = 0;
  Rescale rescale;
  /// As in SourceFacts.
  std::vector<std::string> warnings;
  std::string scale_doubt;
};

/// The field, which only tagrid has, that says that samples were coded with a loss before.
inline constexpr std::string_view meta_image_loss = "LossySource";

/// Headers longer than this are refused.
inline constexpr std::size_t max_meta_image_header_bytes = std::size_t{1} << 20;
/// A volume of more files is refused.
inline constexpr std::int64_t max_meta_image_files = 65536;

/// True if `bytes`, the first 12 or more of a file, begin a MetaImage header.
bool begins_meta_image(std::string_view bytes);

/// True for the names of fields that say how samples are stored or where they lie, in any case of letters.
bool is_read_meta_image_field(std::string_view name);

/// True for the line with which a header ends: ElementDataFile, unless names of files follow it.
bool ends_meta_image_header(std::string_view line);

/// The same header for the plain form of its volume: without compression, and the names of its files as
/// plain_name() says. All else stays, byte for byte. REQUIRES: parse_meta_image_header() has read it.
std::string plain_meta_image_header(std::string_view text);

/// Reads a header: the lines up to and including ElementDataFile, and the names after "ElementDataFile =
/// LIST". Throws BrokenInput if it is broken or describes something other than a volume of real numbers. Safe
/// for any bytes.
MetaImageHeader parse_meta_image_header(std::string_view text);

/// The name of a type in headers: "MET_UCHAR".
std::string_view meta_image_name_of(SampleType type);

/// Reads the volume that a header describes: .mha, and .mhd with the samples in one file or several. `file`
/// was opened at `path` and is at its beginning. Of several volumes, `source.series` chooses one by its
/// number, from 1 on. Throws BrokenInput, UsageError and WorldError.
std::unique_ptr<VolumeSource> open_meta_image(std::unique_ptr<FileBytes> file, const std::string& path,
                                              const SourceDescription& source);

/// The header before the samples of a volume. Positions become those of ITK: left-posterior-superior. Fields
/// that a MetaImage source had come back.
std::string meta_image_header_text(const VolumeInfo& info);

/// The same header in a file of its own. Throws UsageError if a header cannot name the file of the samples.
std::string detached_meta_image_header(const VolumeInfo& info, const std::string& data_file);

/// What MetaImage cannot keep of this volume, one sentence for each loss.
std::vector<std::string> lost_in_meta_image(const VolumeInfo& info);

}  // namespace tagrid
