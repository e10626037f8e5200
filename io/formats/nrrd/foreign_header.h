// NRRD headers of other programs, in which some numbers may be unreadable.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// A header, and what users should know of it: see SourceFacts.
struct ForeignNrrdHeader {
  std::string text;
  std::vector<std::string> warnings, not_understood;
};

/// The same header, with numbers that parse_nrrd_header() reads: a decimal comma becomes a point, an
/// unreadable number of an axis "nan", which means unknown, and lines that cannot be read, comments. Places
/// and values of samples are then unknown where the header does not say them; all else stays, byte for byte.
/// Throws BrokenInput if a line is not one of an NRRD header. Safe for any bytes.
ForeignNrrdHeader foreign_nrrd_header(std::string_view text);

}  // namespace tagrid
