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
  /// Name of a field in lower case, in the standard's first spelling ("data file"); empty for other lines.
  std::string_view field;
  /// The text after the colon of a field, without blanks around it.
  std::string_view value;
};

/// Reads one line, without its line end. Throws BrokenInput if it is not a line of an NRRD header.
NrrdLine parse_nrrd_line(std::string_view line);

/// True if the field says how samples are stored, and so belongs to the file rather than to the volume.
bool is_storage_field(std::string_view field);

/// Removes and returns the first line of `text`, without its '\n' and any '\r' before it.
std::string_view take_line(std::string_view& text);

/// The parts of `text` between blanks.
std::vector<std::string_view> words_of(std::string_view text);

/// The whole of `text` as a number, independent of the locale; "nan" is one.
std::optional<double> number_of(std::string_view text);

/// `text` for a message: shortened, and without characters on which a terminal would act.
std::string quoted(std::string_view text);

std::string lower_case(std::string_view text);

}  // namespace tagrid
