// What users should know of TIFF files.
#pragma once

#include <string>
#include <vector>

namespace tagrid {

/// Sentences without names of files, each once; see SourceFacts.
struct TiffRemarks {
  std::vector<std::string> warnings, not_understood;
  std::string scale_doubt;

  void warn(std::string sentence);
  void miss(std::string sentence);  ///< to `not_understood`
  void doubt(std::string sentence);
  void add(const TiffRemarks& others);
};

}  // namespace tagrid
