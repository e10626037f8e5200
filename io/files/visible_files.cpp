#include "io/files/visible_files.h"

#include <algorithm>
#include <filesystem>

#include "io/errors/errors.h"
#include "io/text/natural_order.h"

namespace tagrid {

std::vector<std::string> visible_files(const std::string& folder) {
  namespace fs = std::filesystem;
  std::vector<std::string> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    std::error_code unknown;
    const fs::file_type type = entry->status(unknown).type();
    const bool may_be_file =
        type == fs::file_type::regular || type == fs::file_type::not_found || type == fs::file_type::none;
    if (may_be_file && !entry->path().filename().string().starts_with('.'))
      files.push_back(entry->path().string());
  }
  if (error) throw world_error("cannot read", folder, error.value());
  std::ranges::sort(files, comes_before);
  return files;
}

}  // namespace tagrid
