// Which files a header names, as far as this can be found without the reader of its format.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace tagrid {

/// Headers of data in other files, by the ends of their names.
struct HeaderKind {
  std::string_view ending;
  std::array<std::string_view, 4> words = {};  ///< needs one of these to name files
  const char* pair = "";  ///< ends of the names of data files that it has without naming them; - for none
};
/// The kind of header that a file with this name is; nullptr if it is not a header.
const HeaderKind* kind_of_header(const std::string& name);

/// Names that headers may use, and the files that they mean. Case is ignored, because a header that
/// was written on Windows may use another case.
class MeantFiles {
 public:
  void add(const std::string& name, const std::string& file);
  /// Adds the files that this text means, if it is a path.
  void find(std::string_view text, std::set<std::string>& files) const;
  /// Adds the numbered files of patterns, as "slice%.raw" for slice001.raw, in lower case.
  void find_numbered(const std::set<std::string>& patterns, std::set<std::string>& files) const;

 private:
  std::multimap<std::string, std::pair<std::string, std::string>> names_;  ///< by names in lower case
};

/// The files that a header names. Reads the header up to about byte `limit`. Throws WorldError if
/// it cannot be read, because it may name any file.
std::set<std::string> files_named_by(const std::string& path, const HeaderKind& kind, const MeantFiles& meant,
                                     std::uint64_t limit);

}  // namespace tagrid
