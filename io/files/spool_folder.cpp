// Where temporary files lie by default. Apart from SpoolFile, as a library must not look at the environment.
#include "io/files/spool_file.h"
#include "io/system/files.h"
#include "io/system/this_process.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

// Beside the output, because there must be space for the result there anyway.
std::string folder_beside(const std::string& path) {
  if (path == "-") return folder_for_temporaries();
  const auto status = status_of(path);
  if (status && !status->is_file()) return folder_for_temporaries();
  return folder_of(path);
}

}  // namespace

SpoolFile SpoolFile::beside(const std::string& path) { return {folder_beside(path), shown_output(path)}; }

std::string spool_folder(const std::optional<std::string>& spool, const std::string& path) {
  return spool ? *spool : folder_beside(path);
}

}  // namespace tagrid
