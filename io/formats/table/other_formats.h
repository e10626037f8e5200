// Files that tagrid does not read as volumes: what they are, and what to do with them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/errors/errors.h"
#include "io/formats/table/formats.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// A format that tagrid does not read. A file has this format if `magic` or `is_mine` matches its
/// first bytes, and if its name has one of the `extensions`, if there are any. Without `magic` and
/// `is_mine`, only the name decides.
struct OtherFormat {
  std::string_view name;    ///< "PNG"; for tests and lists
  std::string_view what;    ///< "is a PNG image", without what to do
  std::string_view advice;  ///< "convert it to TIFF ..."; "" if there is none
  std::vector<Magic> magic = {};
  bool (*is_mine)(std::string_view beginning) = nullptr;
  std::vector<std::string_view> extensions = {};
  /// Where uncompressed samples are in a file that begins like this, if its header states it.
  std::optional<RawDescription> (*layout)(std::string_view beginning) = nullptr;
  Problem problem = Problem::none;
};

/// All rows, in the order in which they are tried.
const std::vector<OtherFormat>& other_formats();

/// The number of bytes at the beginning of a file by which other formats are recognized; all bytes
/// of a shorter file.
inline constexpr std::size_t most_bytes_of_others = std::size_t{1} << 14;

/// The format of a file that begins like this, if it is one of these; nullptr otherwise. `path`: its name, ""
/// or "-" if it has none.
const OtherFormat* other_format_of(std::string_view beginning, const std::string& path);

/// What a file is, and what to do with it: "is a PNG image; convert ...". If its samples are
/// uncompressed and fill the rest of the `size` bytes, the sentence contains the options that
/// describe them.
Sentence about_other_format(const OtherFormat& format, std::string_view beginning,
                            std::optional<std::uint64_t> size);

}  // namespace tagrid
