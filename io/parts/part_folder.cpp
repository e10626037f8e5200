#include "io/parts/part_folder.h"

#include <fmt/format.h>

#include <cerrno>
#include <exception>
#include <string_view>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/held_files.h"
#include "io/files/output_file.h"
#include "io/files/temporaries.h"

namespace tagrid {
namespace {

void unlink_file(const std::string& path) {
  if (!files().unlink(path) && errno != ENOENT) throw world_error("cannot remove", path, errno);
}

std::vector<std::string> names_in(const std::string& folder) {
  std::vector<FolderEntry> entries;
  if (!files().list(folder, entries)) throw world_error("cannot list its files", folder, errno);
  std::vector<std::string> names;
  for (FolderEntry& entry : entries) names.push_back(std::move(entry.name));
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
  if (!files().make_folder(path_, 0700) && !(resumable && errno == EEXIST)) {
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
  const auto is_unrecorded = [&] {
    FileStatus unused;
    return !files().status(record(), true, unused) && errno == ENOENT;
  };
  if (!resumable_) {
    remove_with_files(path_);
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
  if (!status->is_folder())
    throw UsageError(path_ +
                     ": exists and is not a directory, but the run needs a directory of this name for its "
                     "parts; move it away");
  const auto beside = status_of(folder_of(path_));
  if (!beside || beside->device != status->device)
    throw UsageError(path_ + ": is on a different file system from the output; unmount it");
  if (status_of(record())) return;
  for (const std::string& name : names_in(path_))
    if (!is_of_run(name))
      throw UsageError("{}: is not the record of a run: it contains {}; move it away", path_, name);
}

void PartFolder::lock() {
  const std::string name = path_ + "/lock";
  // Repeated if the file was removed in the meantime, at the end of the run that held it.
  for (;;) {
    lock_ = files().open(name, {.read = true, .write = true, .creates = true, .mode = 0600});
    if (lock_ < 0 && errno == ENOENT && files().make_folder(path_, 0700)) continue;
    if (lock_ < 0) throw world_error("cannot create", name, errno);
    if (!files().lock(lock_, false)) {
      const int error = errno;
      // Some file systems have no locks; then the caller must ensure that there is only one run.
      if (error == ENOSYS || error == EOPNOTSUPP || error == ENOLCK) return;
      lock_.reset();
      if (error == EWOULDBLOCK)
        throw HeldByAnother(path_ +
                            ": another process is working on this run; repeat the command when it has ended");
      throw world_error("cannot lock", name, error);
    }
    FileStatus ours;
    const auto named = status_of(name);
    if (files().status(lock_, ours) && named && named->number == ours.number) return;
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
  if (!files().remove_folder(path_) && errno != ENOENT && errno != ENOTEMPTY && errno != EEXIST)
    throw world_error("cannot remove", path_, errno);
}

}  // namespace tagrid
