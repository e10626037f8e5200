#include "io/parts/part_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <exception>
#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/held_by_another.h"
#include "io/files/output_file.h"
#include "io/files/temporaries.h"

namespace tagrid {
namespace {

void unlink_file(const std::string& path) {
  if (unlink(path.c_str()) != 0 && errno != ENOENT) throw world_error("cannot remove", path, errno);
}

std::vector<std::string> names_in(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    names.push_back(entry->path().filename().string());
  if (error) throw world_error("cannot list its files", folder, error.value());
  return names;
}

/// A file that was not completed, or one that had its name before.
bool is_unfinished(std::string_view name) { return target_of_temporary(name) || target_of_older(name); }

/// A part, record, lock or temporary. Other files in the directory do not belong to a run.
bool is_of_run(std::string_view name) {
  const bool is_part = name.size() >= 6 && name.find_first_not_of("0123456789") == name.npos;
  return is_part || name == "run" || name == "lock" || is_unfinished(name);
}

}  // namespace

std::string part_folder_of(const std::string& output) { return hidden_beside(output, ".parts"); }

std::string PartFolder::part(const std::string& folder, std::int64_t number) {
  return fmt::format("{}/{:06}", folder, number);
}

PartFolder::PartFolder(const std::string& output, bool resumable)
    : path_(part_folder_of(output)), resumable_(resumable) {
  if (!resumable) {
    path_.append("-").append(random_suffix());
    slot_ = register_temporary_folder(path_);
  }
  // Only the user may read parts: the permissions of the output are not known here.
  if (mkdir(path_.c_str(), 0700) != 0 && !(resumable && errno == EEXIST)) {
    const int error = errno;
    forget_temporary(std::exchange(slot_, -1));
    throw world_error("cannot create the directory for the parts of the run", path_, error);
  }
  if (!resumable) return;
  require_own();
  lock();
}

PartFolder::~PartFolder() {
  // A run that failed before it had anything to continue from leaves nothing. A record that cannot be
  // checked, on a network file system, counts as existing.
  const auto is_unrecorded = [&] { return access(record().c_str(), F_OK) != 0 && errno == ENOENT; };
  if (!resumable_) {
    remove_folder(path_.c_str());
  } else if (lock_ >= 0 && !removed_ && is_unrecorded()) {
    try {
      remove();
    } catch (const std::exception&) {
      // The first failure is the one that is reported.
    }
  }
  forget_temporary(slot_);
}

void PartFolder::require_own() const {
  const auto status = status_of_name(path_);
  if (!status) return;  // removed at the end of another run
  if (!S_ISDIR(status->st_mode))
    throw UsageError(path_ +
                     ": exists and is not a directory, but the run needs a directory of this name for its "
                     "parts; move it away");
  const auto beside = status_of(folder_of(path_));
  if (!beside || beside->st_dev != status->st_dev)
    throw UsageError(path_ + ": is on a different file system from the output; unmount it");
  if (status_of(record())) return;
  for (const std::string& name : names_in(path_))
    if (!is_of_run(name))
      throw UsageError(
          fmt::format("{}: is not the record of a run: it contains {}; move it away", path_, name));
}

void PartFolder::lock() {
  const std::string name = path_ + "/lock";
  // Repeated if the file was removed in the meantime, at the end of the run that held it.
  for (;;) {
    lock_ = uninterrupted([&] { return open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600); });
    if (lock_ < 0 && errno == ENOENT && mkdir(path_.c_str(), 0700) == 0) continue;
    if (lock_ < 0) throw world_error("cannot create", name, errno);
    if (!lock_now(lock_)) {
      const int error = errno;
      // Some file systems have no locks; then the caller must ensure that there is only one run.
      if (error == ENOSYS || error == EOPNOTSUPP || error == ENOLCK) return;
      lock_.reset();
      if (error == EWOULDBLOCK)
        throw HeldByAnother(path_ +
                            ": another process is working on this run; repeat the command when it has ended");
      throw world_error("cannot lock", name, error);
    }
    struct stat ours = {};
    const auto named = status_of(name);
    if (fstat(lock_, &ours) == 0 && named && named->st_ino == ours.st_ino) return;
    lock_.reset();
  }
}

void PartFolder::remove_unfinished() {
  for (const std::string& name : names_in(path_))
    if (is_unfinished(name)) unlink_file(fmt::format("{}/{}", path_, name));
}

void PartFolder::remove_parts() {
  for (const std::string& name : names_in(path_))
    if (is_of_run(name) && name != "lock" && name != "run") unlink_file(fmt::format("{}/{}", path_, name));
}

void PartFolder::clear() {
  remove_parts();
  unlink_file(record());
}

void PartFolder::remove() {
  clear();
  removed_ = true;
  if (resumable_) unlink_file(path_ + "/lock");
  if (rmdir(path_.c_str()) != 0 && errno != ENOENT && errno != ENOTEMPTY && errno != EEXIST)
    throw world_error("cannot remove", path_, errno);
}

}  // namespace tagrid
