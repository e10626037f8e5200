#include "tools/archive/output_names.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>

#include "io/errors/errors.h"
#include "io/files/output_file.h"
#include "io/files/system_call.h"
#include "tools/archive/manifest.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

constexpr const char* ending = ".tag";

bool goes_up(const fs::path& path) {
  return std::ranges::any_of(path, [](const fs::path& step) { return step == ".."; });
}

/// Such a folder would be mistaken for records, or would block their names.
void refuse_records(const std::string& given, const fs::path& output) {
  const std::string first = output.begin()->string();
  if (first.starts_with("results") && first.ends_with(".jsonl"))
    throw usage_error("{}: {} is a name for a file of records; choose another name for the folder", given,
                      first);
}

/// Calls use(folder) for every folder of `output` below `root`, the outermost first.
template <class Use>
void for_each_folder(const std::string& root, const std::string& output, Use use) {
  fs::path folder = root;
  for (const fs::path& step : fs::path(output).parent_path()) use((folder /= step).string());
}

/// Returns true if the folder exists.
bool is_own_folder(const std::string& folder) {
  const auto status = status_of_name(folder);
  if (status && S_ISLNK(status->st_mode))
    throw UsageError(folder +
                     ": is a symbolic link, but outputs must stay inside the output folder; put a folder "
                     "there, or choose another output");
  if (status && !S_ISDIR(status->st_mode))
    throw UsageError(folder + ": is not a folder; choose another output");
  return status.has_value();
}

}  // namespace

std::string output_called(const std::string& name) {
  const fs::path path = name;
  if (path.is_absolute()) throw usage_error("output={}: must be a path inside the output folder", name);
  if (goes_up(path)) throw usage_error("output={}: must not contain ..", name);
  fs::path output = path.lexically_normal();
  if (output.filename().empty() || output == ".")
    throw usage_error("output={}: is not the name of a file", name);
  if (output.extension() != ending) output += ending;
  refuse_records("output=" + name, output);
  return output.string();
}

std::string output_mirroring(const std::string& listed, bool is_folder) {
  const fs::path path = listed;
  // ".." may lead through a link, so the name would not show the folder of the volume.
  if (path.is_absolute() || goes_up(path))
    throw usage_error(
        "{}: --keep-folders needs a relative path without ..; name its output in a column output=NAME",
        listed);
  const fs::path normal = path.lexically_normal();
  const fs::path output =
      normal.parent_path() / ((is_folder ? normal.filename() : normal.stem()).string() + ending);
  refuse_records(listed, output);
  return output.string();
}

void require_own_folders(const std::string& root, const std::string& output) {
  for_each_folder(root, output, is_own_folder);
}

void make_own_folders(const std::string& root, const std::string& output) {
  for_each_folder(root, output, [](const std::string& folder) {
    // Another process may create the folder at the same time. It is durable when either process returns.
    if (!is_own_folder(folder) && mkdir(folder.c_str(), 0777) != 0 && errno != EEXIST)
      throw world_error("cannot create the folder", folder, errno);
    is_own_folder(folder);
    if (const int error = sync_folder(folder_of(folder)); error != 0)
      throw world_error("cannot sync its parent folder", folder, error);
  });
}

}  // namespace tagrid
