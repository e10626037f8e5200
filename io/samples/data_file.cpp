#include "io/samples/data_file.h"

#include <fmt/format.h>

#include <filesystem>

#include "io/errors/errors.h"
#include "io/files/system_call.h"
#include "io/text/text.h"

namespace tagrid {

std::string path_of_data_file(const std::string& header_path, const std::string& data_file) {
  if (header_path == "-") return data_file;
  return (std::filesystem::path(header_path).parent_path() / data_file).string();
}

std::unique_ptr<FileBytes> open_data_file(const std::string& path, const std::string& data_file,
                                          const std::string& header_name, std::string_view format) {
  const auto status = status_of(path);
  // Opening reports missing files and folders.
  const bool is_plain = !status || S_ISREG(status->st_mode) || S_ISDIR(status->st_mode);
  if (data_file == "-" || !is_plain)
    throw BrokenInput(fmt::format("{}: {} header: data file: {}: must name a file, not a stream or a device",
                                  header_name, format, tagrid::quoted(std::string_view(data_file))));
  try {
    return std::make_unique<FileBytes>(path);
  } catch (const WorldError& error) {
    throw WorldError(fmt::format("{}; it is the data file that {} names", error.what(), header_name));
  }
}

}  // namespace tagrid
