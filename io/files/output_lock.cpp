#include "io/files/output_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

#include "io/errors/errors.h"
#include "io/files/temporaries.h"

namespace tagrid {
namespace {

/// If another user left the file, and this process may not write to it, it can still be locked on a
/// local file system.
Descriptor opened(const std::string& name) {
  constexpr int flags = O_CLOEXEC | O_NOFOLLOW;
  Descriptor file = uninterrupted([&] { return open(name.c_str(), O_RDWR | O_CREAT | flags, 0666); });
  if (file < 0 && errno == EACCES) {
    file = uninterrupted([&] { return open(name.c_str(), O_RDONLY | flags); });
    if (file < 0 && errno == ENOENT) errno = EACCES;  // the directory is not writable
  }
  return file;
}

/// True if the open file is now locked, or cannot be because the file system has no locks. False if another process
/// holds it.
bool is_locked(int file, const std::string& name) {
  if (lock_now(file) || errno == ENOSYS || errno == EOPNOTSUPP || errno == ENOLCK || errno == EBADF)
    return true;
  if (errno == EWOULDBLOCK) return false;
  throw world_error("cannot lock", name, errno);
}

/// True if the open file still has this name: the process that held the lock before may have
/// removed it. The name is opened again, because a network file system may report for a while which
/// file had it before. Throws UsageError for a file with content, which is not a lock, and
/// WorldError.
bool has_name(int file, const std::string& name) {
  const Descriptor named = opened(name);
  struct stat ours = {}, found = {};
  if (named < 0 || fstat(file, &ours) != 0 || fstat(named, &found) != 0) {
    const int error = errno;
    unlink(name.c_str());  // nothing was created but this
    throw world_error("cannot open the lock", name, error);
  }
  if (ours.st_size > 0)
    throw UsageError(name + ": has the name that tagrid needs for a lock, but is another file; rename it");
  return ours.st_dev == found.st_dev && ours.st_ino == found.st_ino;
}

}  // namespace

std::string lock_of_output(const std::string& path) { return hidden_beside(path, ".lock"); }

OutputLock::OutputLock(const std::string& path) : name_(lock_of_output(path)) {
  for (;;) {
    {
      // A signal that ends the process must not leave the file, nor remove that of another process.
      const SignalsWait wait;
      descriptor_ = opened(name_);
      if (descriptor_ < 0) throw world_error("cannot create the lock", name_, errno);
      if (is_locked(descriptor_, name_) && has_name(descriptor_, name_)) {
        slot_ = register_temporary(name_);
        fchmod(descriptor_,
               0666);  // other users wait for it, whatever the umask; fails if the file is theirs
        return;
      }
    }
    // Waits for the process that holds it, and tries again.
    uninterrupted([&] { return flock(descriptor_, LOCK_EX); });
  }
}

OutputLock::~OutputLock() {
  unlink(name_.c_str());
  forget_temporary(slot_);
}

}  // namespace tagrid
