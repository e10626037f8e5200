#include "io/files/output_file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <filesystem>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/temporaries.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

std::string file_name_of(const std::string& path) { return std::filesystem::path(path).filename().string(); }

/// True for files that are not regular, such as /dev/null or a named pipe: they are written directly.
bool is_special(const std::string& path) {
  const auto status = status_of(path);
  return status && !S_ISREG(status->st_mode) && !S_ISDIR(status->st_mode);
}

UsageError exists_already(const std::string& path) {
  return UsageError(path + ": already exists", Problem::output_exists);
}

/// Waits until a non-blocking stream takes more.
void wait_for_room(int descriptor) {
  pollfd ready = {descriptor, POLLOUT, 0};
  poll(&ready, 1, -1);
}

}  // namespace

int rename_to_new(const std::string& from, const std::string& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  if (link(from.c_str(), to.c_str()) != 0) return errno;
  if (unlink(from.c_str()) == 0) return 0;
  const int error = errno;
  unlink(to.c_str());
  return error;
}

int sync_folder(const std::string& folder) {
  const Descriptor descriptor =
      uninterrupted([&] { return open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); });
  if (descriptor < 0) return errno == EACCES || errno == EPERM ? 0 : errno;
  const int error = uninterrupted([&] { return fsync(descriptor); }) != 0 ? errno : 0;
  return error == EINVAL || error == ENOTSUP ? 0 : error;
}

void check_output(const std::string& path, bool overwrite) {
  if (path == "-") return;
  const auto status = status_of_name(path);
  if (!status || is_special(path)) return;
  if (S_ISDIR(status->st_mode)) throw UsageError(path + ": is a directory; give the name of a file");
  if (!overwrite) throw exists_already(path);
}

OutputFile::OutputFile(const std::string& path, bool overwrite, OutputFileOptions options)
    : path_(path), name_(shown_output(path)), overwrite_(overwrite), options_(std::move(options)) {
  check_output(path, overwrite);
  if (path == "-") {
    descriptor_ = STDOUT_FILENO;
  } else if (is_special(path)) {
    descriptor_ = uninterrupted([&] { return open(path.c_str(), O_WRONLY | O_CLOEXEC); });
    if (descriptor_ < 0) throw world_error("cannot open", name_, errno);
  } else {
    create_temporary();
  }
}

OutputFile::~OutputFile() {
  if (published_) take_back();
  if (!temporary_.empty()) unlink(temporary_.c_str());
  forget_temporary(slot_);
  if (descriptor_ >= 0 && descriptor_ != STDOUT_FILENO) close(descriptor_);
}

std::string OutputFile::hidden_path(const std::string& name) const {
  const std::filesystem::path folder = options_.temporaries.empty()
                                           ? std::filesystem::path(path_).parent_path()
                                           : std::filesystem::path(options_.temporaries);
  return (folder / name).string();
}

void OutputFile::create_temporary() {
  const std::string target = file_name_of(path_);
  if (target.empty()) throw UsageError(path_ + ": is not the name of a file");
  for (int attempt = 0; attempt < 100; ++attempt) {
    const std::string candidate = hidden_path(temporary_name(target));
    // Registered before it is created, so that a signal in between does not leave it. Its mode is that of any
    // new file, or private until it gets that of another file.
    slot_ = register_temporary(candidate);
    const mode_t mode = options_.like ? 0600 : 0666;
    descriptor_ =
        uninterrupted([&] { return open(candidate.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, mode); });
    const int error = errno;
    if (descriptor_ >= 0 && hold_temporary(descriptor_)) {
      temporary_ = candidate;
      if (options_.like && !options_.others_write) set_permissions(descriptor_, *options_.like);
      return;
    }
    forget_temporary(std::exchange(slot_, -1));
    if (descriptor_ >= 0)
      close(std::exchange(descriptor_, -1));
    else if (error != EEXIST)
      throw world_error("cannot create", name_, error);
  }
  throw world_error("cannot create", name_, EEXIST);
}

void OutputFile::write(std::span<const std::byte> bytes) {
  assert(descriptor_ >= 0);
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor_, bytes.data(), std::min(bytes.size(), std::size_t{1} << 30));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EAGAIN) {
      wait_for_room(descriptor_);
      continue;
    }
    if (count < 0 && errno == EPIPE) throw ClosedPipe(name_ + ": the reader closed the pipe");
    if (count < 0) throw world_error("cannot write", name_, errno);
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    position_ += static_cast<std::uint64_t>(count);
  }
}

void OutputFile::write_at(std::uint64_t position, std::span<const std::byte> bytes) {
  assert(can_seek());
  if (!write_all_at(descriptor_, position, bytes)) throw world_error("cannot write", name_, errno);
}

void OutputFile::sync() {
  if (options_.like && !temporary_.empty() && !synced_) {
    if (options_.others_write) set_permissions(descriptor_, *options_.like);
    set_times(descriptor_, *options_.like);
  }
  if (!temporary_.empty() && !synced_ && uninterrupted([&] { return fsync(descriptor_); }) != 0)
    throw world_error("cannot write", name_, errno);
  synced_ = true;
}

void OutputFile::close_descriptor() {
  int descriptor = std::exchange(descriptor_, -1);
  // Network file systems report some failed writes only in close(). Standard output must stay open; closing
  // any of its descriptors reports them.
  if (descriptor == STDOUT_FILENO) descriptor = dup(STDOUT_FILENO);
  if (descriptor >= 0 && close(descriptor) != 0 && errno != EINTR)
    throw world_error("cannot write", name_, errno);
}

/// Keeps the file that has the name under another one, until nothing can fail any more. Some file systems
/// cannot do that; there the older file is gone once the new one has its name.
void OutputFile::set_older_aside() {
  const std::string candidate = hidden_path(older_name(file_name_of(path_)));
  older_slot_ = register_temporary(candidate, path_);
  if (link(path_.c_str(), candidate.c_str()) == 0) {
    older_ = candidate;
  } else {
    forget_temporary(std::exchange(older_slot_, -1));
  }
}

void OutputFile::give_name() {
  int error = 0;
  if (!overwrite_)
    error = rename_to_new(temporary_, path_);
  else if (rename(temporary_.c_str(), path_.c_str()) != 0)
    error = errno;
  published_ = true;  // also on failure: the older file has two names
  if (error == EEXIST) throw exists_already(path_);
  if (error != 0) throw world_error("cannot rename the finished file to", name_, error);
  temporary_.clear();
  forget_temporary(slot_);
  slot_ = older_.empty() ? register_temporary(path_) : -1;
}

void OutputFile::take_back() noexcept {
  published_ = false;
  if (!older_.empty()) {
    // rename() does nothing if both names belong to one file: then the second name has to go.
    if (rename(older_.c_str(), path_.c_str()) == 0) unlink(older_.c_str());
    forget_temporary(std::exchange(older_slot_, -1));
  } else if (temporary_.empty()) {
    unlink(path_.c_str());
  }
  older_.clear();
}

void OutputFile::publish() {
  assert(descriptor_ >= 0);
  sync();
  close_descriptor();
  if (temporary_.empty()) return;
  if (overwrite_) set_older_aside();
  try {
    give_name();
    if (const int error = sync_folder(folder_of(path_)); error != 0)
      throw world_error("cannot sync its directory", name_, error);
  } catch (...) {
    take_back();
    throw;
  }
}

void OutputFile::keep() {
  published_ = false;
  forget_temporary(std::exchange(slot_, -1));
  if (older_.empty()) return;
  const std::string older = std::exchange(older_, "");
  const int error = unlink(older.c_str()) != 0 ? errno : 0;
  forget_temporary(std::exchange(older_slot_, -1));
  if (error != 0) throw world_error("cannot remove the older file of this name", older, error);
}

PlacedFile::PlacedFile(const std::string& path, std::string name, bool is_new) : name_(std::move(name)) {
  const int flags = O_WRONLY | O_CLOEXEC | (is_new ? O_CREAT | O_EXCL : 0);
  descriptor_ = uninterrupted([&] { return open(path.c_str(), flags, 0600); });
  if (descriptor_ < 0)
    throw world_error(is_new ? "cannot create" : "cannot open its temporary file", name_, errno);
}

void PlacedFile::resize(std::uint64_t size) {
  if (uninterrupted([&] { return ftruncate(descriptor_, static_cast<off_t>(size)); }) != 0)
    throw world_error("cannot write", name_, errno);
}

void PlacedFile::set_attributes(const FileAttributes& attributes) {
  set_permissions(descriptor_, attributes);
  set_times(descriptor_, attributes);
}

void PlacedFile::write_at(std::uint64_t position, std::span<const std::byte> bytes) {
  if (!write_all_at(descriptor_, position, bytes)) throw world_error("cannot write", name_, errno);
}

void PlacedFile::finish() {
  if (uninterrupted([&] { return fsync(descriptor_); }) != 0) throw world_error("cannot write", name_, errno);
  // Network file systems report some failed writes only in close().
  if (close(descriptor_.release()) != 0 && errno != EINTR) throw world_error("cannot write", name_, errno);
}

}  // namespace tagrid
