// One line of an NRRD header. The format: https://teem.sourceforge.net/nrrd/format.html
#pragma once

#include <string_view>

namespace tagrid {

struct NrrdLine {
  enum class Kind { comment, key_value, field };
  Kind kind = Kind::comment;
  /// Name of a field in lower case, in the standard's first spelling ("data file"); empty for other lines.
  std::string_view field;
  /// The text after the colon of a field, without blanks around it.
  std::string_view value;
};

/// Reads one line, without its line end. Throws BrokenInput if it is not a line of an NRRD header.
NrrdLine parse_nrrd_line(std::string_view line);

/// True if the field says how samples are stored, and so belongs to the file rather than to the volume.
bool is_storage_field(std::string_view field);

}  // namespace tagrid
