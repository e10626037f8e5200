#include "io/files/output_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/output_file.h"

namespace tagrid {
namespace {

std::string without_slashes(std::string path) {
  while (path.size() > 1 && path.ends_with('/')) path.pop_back();
  return path;
}

std::string last_name(const std::string& path) { return path.substr(path.rfind('/') + 1); }

/// The folder in which the hidden directory is made, which must be there.
std::string existing_folder_of(const std::string& path) {
  const std::string folder = folder_of(path);
  if (!status_of(folder)) throw world_error("cannot create", path, ENOENT);
  return folder;
}

int exchange_names(const std::string& a, const std::string& b) {
  return renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0 ? 0 : errno;
}

}  // namespace

OutputFolder::OutputFolder(const std::string& path, bool overwrite, std::optional<FileAttributes> like,
                           MayReplace may_replace)
    : path_(without_slashes(path)),
      name_(path_),
      overwrite_(overwrite),
      like_(std::move(like)),
      may_replace_(may_replace),
      staging_((require_target(), existing_folder_of(path_)), last_name(path_)) {}

OutputFolder::~OutputFolder() {
  take_back();
  // The hidden directory is removed before a signal that waits.
  staging_.remove({});
}

void OutputFolder::require_target() const {
  const auto status = status_of_name(path_);
  if (!status) return;
  if (!S_ISDIR(status->st_mode)) throw UsageError(name_ + ": is a file; give the name of a directory");
  if (!overwrite_) throw UsageError(name_ + ": already exists", Problem::output_exists);
  std::error_code unknown;
  if (!std::filesystem::is_empty(path_, unknown) && !may_replace_(path_))
    throw UsageError(name_ + ": is a directory of other files, which is not replaced; give another name");
}

void OutputFolder::begin(const std::string& file) {
  assert(file_ < 0);
  for (std::size_t slash = file.find('/'); slash != file.npos; slash = file.find('/', slash + 1)) {
    const std::string folder = file.substr(0, slash);
    if (!folders_.insert(folder).second) continue;
    if (mkdir((staging_.path() + "/" + folder).c_str(), 0777) != 0)
      throw world_error("cannot write", name_, errno);
  }
  const std::string path = staging_.path() + "/" + file;
  file_ = uninterrupted(
      [&] { return open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, like_ ? 0600 : 0666); });
  if (file_ < 0) throw world_error("cannot write", name_, errno);
  if (like_) set_permissions(file_, *like_);
  position_ = 0;
}

void OutputFolder::write(std::span<const std::byte> bytes) {
  if (!write_all_at(file_, position_, bytes)) throw world_error("cannot write", name_, errno);
  position_ += bytes.size();
  bytes_ += bytes.size();
}

void OutputFolder::end() {
  if (like_) set_times(file_, *like_);
  if (uninterrupted([&] { return fsync(file_); }) != 0) throw world_error("cannot write", name_, errno);
  // Network file systems report some failed writes only in close().
  if (close(file_.release()) != 0 && errno != EINTR) throw world_error("cannot write", name_, errno);
}

void OutputFolder::sync_folders() const {
  for (const std::string& folder : folders_) {
    const std::string path = staging_.path() + "/" + folder;
    if (like_) {
      const mode_t readable = like_->mode & 0444u;
      if (chmod(path.c_str(), (like_->mode & 0666u) | (readable >> 2u) | S_IRWXU) != 0)
        throw world_error("cannot write", name_, errno);
    } else if (folder.empty()) {  // was private
      const mode_t mask = umask(0);
      umask(mask);
      if (chmod(path.c_str(), 0777u & ~mask) != 0) throw world_error("cannot write", name_, errno);
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
    error = exchange_names(staging_.path(), path_);
    if (error == 0) state_ = State::exchanged;
    if (error == EINVAL || error == ENOSYS)
      throw UsageError(
          name_ + ": already exists, and this file system cannot replace a directory; remove it first",
          Problem::output_exists);
  } else {
    // Replaces an empty directory that was made in the meantime, but no other one.
    error = rename(staging_.path().c_str(), path_.c_str()) == 0 ? 0 : errno;
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
  if (state == State::exchanged) exchange_names(staging_.path(), path_);
  if (state == State::named) std::rename(path_.c_str(), staging_.path().c_str());
}

}  // namespace tagrid
