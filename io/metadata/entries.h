// The lines of an NRRD header, and its key-value pairs. The format:
// https://teem.sourceforge.net/nrrd/format.html
#pragma once

#include <cstddef>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tagrid {

struct NrrdLine {
  enum class Kind { comment, key_value, field };
  Kind kind = Kind::comment;
  /// Name of a field in lower case, in the standard's first spelling ("data file"); empty for other lines.
  std::string_view field = {};
  /// The text after the colon of a field, without blanks around it; what follows ":=" in a pair, as it is
  /// written.
  std::string_view value = {};
  std::string_view key = {};   ///< of a pair
  std::string_view text = {};  ///< the entire line
};

/// Reads one line, without its line end. Throws BrokenInput if it is not a line of an NRRD header.
NrrdLine parse_nrrd_line(std::string_view line);
/// Several lines, each read when it is its turn: the lines of a hostile header take no memory. Incrementing
/// throws as above.
class NrrdLines {
 public:
  class Iterator {
   public:
    using value_type = NrrdLine;
    using difference_type = std::ptrdiff_t;
    Iterator() = default;
    explicit Iterator(std::string_view rest) : rest_(rest) { ++*this; }
    const NrrdLine& operator*() const { return line_; }
    Iterator& operator++();
    void operator++(int) { ++*this; }
    bool operator==(std::default_sentinel_t) const { return is_at_end_; }

   private:
    std::string_view rest_;
    NrrdLine line_;
    bool is_at_end_ = true;
  };
  explicit NrrdLines(std::string_view lines) : lines_(lines) {}
  Iterator begin() const { return Iterator(lines_); }
  std::default_sentinel_t end() const { return {}; }

 private:
  std::string_view lines_;
};
inline NrrdLines nrrd_lines(std::string_view lines) { return NrrdLines(lines); }

/// True if the field says how samples are stored, and so belongs to the file rather than to the volume.
bool is_storage_field(std::string_view field);

/// What else is known about a volume: names and texts.
using KeyValues = std::vector<std::pair<std::string, std::string>>;

/// The key-value pairs of NRRD header lines, in order. Of equal keys, the last one counts, as in teem. Throws
/// BrokenInput if a line is not one of a header.
KeyValues key_values_of(std::string_view nrrd_fields);

/// The key under which readers say that samples were compressed with a loss before, and by what: "TIFF,
/// JPEG".
inline constexpr std::string_view lossy_source_key = "lossy source";

/// Returns the text of a key, or "" if the key is absent. Throws as key_values_of() does.
std::string text_of_key(std::string_view nrrd_fields, std::string_view key);

/// The pairs that stay true if samples get other places: all but the positions of slices. Throws as
/// key_values_of() does.
KeyValues pairs_without_places(std::string_view nrrd_fields);

/// NRRD header lines without what is not needed to understand the samples: of key-value pairs, only slopes,
/// intercepts and positions of slices stay, what OpenVDB grids need, doubts, and that samples have a loss;
/// comments and the content go.
std::string stripped(std::string_view nrrd_fields);

}  // namespace tagrid
