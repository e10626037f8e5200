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

/// A format that tagrid does not read. A file has it if it begins as `magic` or `is_mine` say; with
/// `extensions`, also its name must have one of them. A row without magic and `is_mine` goes by names alone.
struct OtherFormat {
  std::string_view name;    ///< "PNG"; for tests and lists
  std::string_view what;    ///< "is a PNG image", without what to do
  std::string_view advice;  ///< "convert it to TIFF ..."; "" if there is none
  std::vector<Magic> magic = {};
  bool (*is_mine)(std::string_view beginning) = nullptr;
  std::vector<std::string_view> extensions = {};
  /// Where samples lie plainly in a file that begins like this, if its header says so.
  std::optional<RawDescription> (*layout)(std::string_view beginning) = nullptr;
  Problem problem = Problem::none;
};

/// All rows, in the order in which they are tried.
const std::vector<OtherFormat>& other_formats();

/// Other formats are recognized by so many bytes of a file, or all of a shorter one.
inline constexpr std::size_t most_bytes_of_others = std::size_t{1} << 14;

/// The format of a file that begins like this, if it is one of these; nullptr otherwise. `path`: its name, ""
/// or "-" if it has none.
const OtherFormat* other_format_of(std::string_view beginning, const std::string& path);

/// What a file is, and what to do with it: "is a PNG image; convert ...". If its samples lie plainly and take
/// up the rest of `size` bytes, the sentence says how to describe them.
Sentence about_other_format(const OtherFormat& format, std::string_view beginning,
                            std::optional<std::uint64_t> size);

/// What a directory is, as above, if it is one of these formats as it were; nothing otherwise.
std::optional<std::string_view> other_format_of_folder(const std::string& folder);

}  // namespace tagrid
