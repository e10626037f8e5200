// Headers that name the data files of other headers: removing the volume of one would break the other.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tagrid {

/// Why a file is not only of the volume at `input`, a file: it lies beside this header and has not its name, as all.raw
/// beside a.mhd. Returns "" if it is the header itself or has its name, as a.raw and a_001.raw.
std::string not_own_name(const std::string& input, const std::string& file);

/// The headers of directories, by the files that they name. Each directory is read once. A header is a file whose name
/// ends as those of formats that have data in other files. Lists and checksums are none.
class OtherHeaders {
 public:
  struct Named {
    std::string file, header;
  };
  /// The first of the files of a volume that a header names which lies beside it and is not one of them. Throws
  /// WorldError if a header cannot be read.
  std::optional<Named> first_named(const std::vector<std::string>& volume);

 private:
  using Headers = std::map<std::string, std::vector<std::string>>;  ///< by the names of files
  const Headers& in_folder(const std::string& folder);

  std::map<std::string, Headers> folders_;
};

}  // namespace tagrid
