// One line of an NRRD header. The format: https://teem.sourceforge.net/nrrd/format.html
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

struct NrrdLine {
  enum class Kind { comment, key_value, field };
  Kind kind = Kind::comment;
  /// Name of the field in lower case and in the standard's first spelling ("data file"); of a field only.
  std::string_view field;
  /// What follows the colon of a field, without blanks around it.
  std::string_view value;
};

/// Reads one line, without its line end. Throws BrokenInput if it is no line of an NRRD header.
NrrdLine parse_nrrd_line(std::string_view line);

/// Whether the field says how samples are stored, and so belongs to the file rather than to the volume.
bool is_storage_field(std::string_view field);

/// Removes and returns the first line of `text`, without '\n' or "\r\n" (or more of '\r').
std::string_view take_line(std::string_view& text);

/// The parts of `text` between blanks.
std::vector<std::string_view> words_of(std::string_view text);

/// The whole of `text` as a number, whatever the locale says; "nan" is one.
std::optional<double> number_of(std::string_view text);

/// `text` for a message: shortened, and without anything that a terminal would act on.
std::string quoted(std::string_view text);

std::string lower_case(std::string_view text);

}  // namespace tagrid
