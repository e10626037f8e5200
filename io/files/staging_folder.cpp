#include "io/files/staging_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/temporaries.h"

namespace tagrid {
namespace {

constexpr int most_attempts = 100;

/// The directory and those around it that do not exist, from the outermost one on.
std::vector<std::string> missing_folders(const std::string& folder) {
  std::vector<std::string> missing;
  for (std::size_t end = folder.find('/', 1);; end = folder.find('/', end + 1)) {
    const std::string path = folder.substr(0, end);
    if (!status_of(path)) missing.push_back(path);
    if (end == folder.npos) return missing;
  }
}

}  // namespace

StagingFolder::StagingFolder(std::string folder, const std::string& name) : folder_(std::move(folder)) {
  while (folder_.size() > 1 && folder_.ends_with('/')) folder_.pop_back();
  const auto status = status_of(folder_);
  if (status && !S_ISDIR(status->st_mode))
    throw UsageError(folder_ + ": is not a directory; give the directory for the files");
  const std::vector<std::string> missing = status ? std::vector<std::string>() : missing_folders(folder_);
  const std::string outermost = missing.empty() ? "" : missing.front();
  try {
    for (int attempt = 1; path_.empty(); ++attempt) {
      const std::string candidate = folder_ + "/" + temporary_name(name);
      forget_temporary(slot_);
      slot_ = register_temporary_folder(candidate, outermost);  // a signal may come at any time
      if (attempt == 1)
        for (const std::string& path : missing) make(path);
      if (!make_hidden(candidate) && attempt == most_attempts)
        throw world_error("cannot create a directory in", folder_, EEXIST);
    }
  } catch (...) {
    let_go();
    throw;
  }
}

StagingFolder::~StagingFolder() {
  if (!path_.empty()) remove_folder(path_.c_str());
  let_go();
}

void StagingFolder::let_go() {
  descriptor_.reset();
  if (!kept_)
    for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder) rmdir(folder->c_str());
  forget_temporary(std::exchange(slot_, -1));
}

void StagingFolder::make(const std::string& folder) {
  if (mkdir(folder.c_str(), 0777) == 0) {
    made_.push_back(folder);
    return;
  }
  const int error = errno;
  // Somebody else may have made it in the meantime.
  const auto status = status_of(folder);
  if (!status || !S_ISDIR(status->st_mode)) throw world_error("cannot create the directory", folder, error);
}

/// Makes the hidden directory, and holds it, so that nobody takes it for abandoned. Returns false if the name
/// is taken, or if somebody has just removed it.
bool StagingFolder::make_hidden(const std::string& candidate) {
  if (mkdir(candidate.c_str(), 0700) != 0) {
    if (errno == EEXIST) return false;
    throw world_error("cannot create a directory in", folder_, errno);
  }
  descriptor_ = uninterrupted([&] { return open(candidate.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); });
  if (descriptor_ < 0 && errno != ENOENT) {
    const int error = errno;
    rmdir(candidate.c_str());
    throw world_error("cannot open a new directory in", folder_, error);
  }
  if (descriptor_ >= 0 && hold_temporary(descriptor_)) {
    path_ = candidate;
    return true;
  }
  descriptor_.reset();
  return false;
}

bool StagingFolder::remove(const std::vector<std::string>& files) {
  // By their names, since the directory may not be readable just now.
  for (const std::string& file : files) unlink(file.c_str());
  const bool is_gone = rmdir(path_.c_str()) == 0 || remove_folder(path_.c_str());
  path_.clear();
  let_go();
  return is_gone;
}

}  // namespace tagrid
