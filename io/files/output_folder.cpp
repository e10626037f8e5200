#include "io/files/output_folder.h"

#include <cassert>
#include <cerrno>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/temporaries.h"
#include "io/text/paths.h"

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

std::string without_slashes(std::string path) {
  while (path.size() > 1 && path.ends_with('/')) path.pop_back();
  return path;
}

/// The folder in which the hidden directory is made, which must be there.
std::string existing_folder_of(const std::string& path) {
  const std::string folder = folder_of(path);
  if (!status_of(folder)) throw world_error("cannot create", path, ENOENT);
  return folder;
}

}  // namespace

StagingFolder::StagingFolder(std::string folder, const std::string& name) : folder_(std::move(folder)) {
  while (folder_.size() > 1 && folder_.ends_with('/')) folder_.pop_back();
  const auto status = status_of(folder_);
  if (status && !status->is_folder())
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
  if (!path_.empty()) remove_with_files(path_);
  let_go();
}

void StagingFolder::let_go() {
  descriptor_.reset();
  if (!kept_)
    for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder) files().remove_folder(*folder);
  forget_temporary(std::exchange(slot_, -1));
}

void StagingFolder::make(const std::string& folder) {
  if (files().make_folder(folder)) {
    made_.push_back(folder);
    return;
  }
  const int error = errno;
  // Somebody else may have made it in the meantime.
  const auto status = status_of(folder);
  if (!status || !status->is_folder()) throw world_error("cannot create the directory", folder, error);
}

/// Makes the hidden directory, and holds it, so that nobody takes it for abandoned. Returns false if the name
/// is taken, or if somebody has just removed it.
bool StagingFolder::make_hidden(const std::string& candidate) {
  if (!files().make_folder(candidate, 0700)) {
    if (errno == EEXIST) return false;
    throw world_error("cannot create a directory in", folder_, errno);
  }
  descriptor_ = files().open_folder(candidate);
  if (descriptor_ < 0 && errno != ENOENT) {
    const int error = errno;
    files().remove_folder(candidate);
    throw world_error("cannot open a new directory in", folder_, error);
  }
  if (descriptor_ >= 0 && hold_temporary(descriptor_)) {
    path_ = candidate;
    return true;
  }
  descriptor_.reset();
  return false;
}

bool StagingFolder::remove(const std::vector<std::string>& in_it) {
  // By their names, since the directory may not be readable just now.
  for (const std::string& file : in_it) files().unlink(file);
  const bool is_gone = files().remove_folder(path_) || remove_with_files(path_);
  path_.clear();
  let_go();
  return is_gone;
}

OutputFolder::OutputFolder(const std::string& path, bool overwrite, std::optional<FileAttributes> like,
                           MayReplace may_replace)
    : path_(without_slashes(path)),
      name_(path_),
      overwrite_(overwrite),
      like_(std::move(like)),
      may_replace_(may_replace),
      staging_((require_target(), existing_folder_of(path_)), name_of_path(path_)) {}

OutputFolder::~OutputFolder() {
  take_back();
  // The hidden directory is removed before a signal that waits.
  staging_.remove({});
}

void OutputFolder::require_target() const {
  const auto status = status_of_name(path_);
  if (!status) return;
  if (!status->is_folder()) throw UsageError(name_ + ": is a file; give the name of a directory");
  if (!overwrite_) throw UsageError(name_ + ": already exists", Problem::output_exists);
  std::vector<FolderEntry> entries;
  if ((!files().list(path_, entries) || !entries.empty()) && !may_replace_(path_))
    throw UsageError(name_ + ": is a directory of other files, which is not replaced; give another name");
}

void OutputFolder::begin(const std::string& file) {
  assert(file_ < 0);
  for (std::size_t slash = file.find('/'); slash != file.npos; slash = file.find('/', slash + 1)) {
    const std::string folder = file.substr(0, slash);
    if (!folders_.insert(folder).second) continue;
    if (!files().make_folder(staging_.path() + "/" + folder)) throw world_error("cannot write", name_, errno);
  }
  const std::string path = staging_.path() + "/" + file;
  file_ = files().open(path, {.write = true, .creates = true, .is_new = true, .mode = like_ ? 0600u : 0666u});
  if (file_ < 0) throw world_error("cannot write", name_, errno);
  if (like_) set_permissions(file_, *like_);
  position_ = 0;
}

void OutputFolder::write(std::span<const std::byte> bytes) {
  if (!files().write_at(file_, position_, bytes)) throw world_error("cannot write", name_, errno);
  position_ += bytes.size();
  bytes_ += bytes.size();
}

void OutputFolder::end() {
  if (like_) set_times(file_, *like_);
  if (!files().sync(file_)) throw world_error("cannot write", name_, errno);
  // Network file systems report some failed writes only in close().
  if (!files().close(file_.release())) throw world_error("cannot write", name_, errno);
}

void OutputFolder::sync_folders() const {
  for (const std::string& folder : folders_) {
    const std::string path = staging_.path() + "/" + folder;
    if (like_) {
      const unsigned readable = like_->mode & 0444u;
      if (!files().set_mode(path, (like_->mode & 0666u) | (readable >> 2u) | 0700u))
        throw world_error("cannot write", name_, errno);
    } else if (folder.empty()) {  // was private
      if (!files().set_mode(path, mode_of_new_folders())) throw world_error("cannot write", name_, errno);
    }
    if (const int error = sync_folder(path); error != 0) throw world_error("cannot write", name_, error);
  }
}

void OutputFolder::publish() {
  assert(file_ < 0 && state_ == State::hidden);
  sync_folders();
  signals_wait_.emplace();
  require_target();
  int error = 0;
  if (status_of_name(path_)) {
    error = files().exchange(staging_.path(), path_) ? 0 : errno;
    if (error == 0) state_ = State::exchanged;
    if (error == EINVAL || error == ENOSYS)
      throw UsageError(
          name_ + ": already exists, and this file system cannot replace a directory; remove it first",
          Problem::output_exists);
  } else {
    // Replaces an empty directory that was made in the meantime, but no other one.
    error = files().rename(staging_.path(), path_) ? 0 : errno;
    if (error == 0) state_ = State::named;
  }
  if (error != 0) throw world_error("cannot rename the finished directory to", name_, error);
  if (error = sync_folder(folder_of(path_)); error != 0) {
    take_back();
    throw world_error("cannot sync its directory", name_, error);
  }
}

void OutputFolder::keep() {
  // What is hidden after an exchange is the older directory.
  const bool has_older = std::exchange(state_, State::hidden) == State::exchanged;
  const bool is_gone = staging_.remove({});
  const int error = errno;
  signals_wait_.reset();
  if (has_older && !is_gone)
    throw world_error("cannot remove the older directory of this name beside", name_, error);
}

void OutputFolder::take_back() noexcept {
  const State state = std::exchange(state_, State::hidden);
  if (state == State::exchanged) files().exchange(staging_.path(), path_);
  if (state == State::named) files().rename(path_, staging_.path());
}

}  // namespace tagrid
