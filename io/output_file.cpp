#include "io/output_file.h"

#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

#include "io/errors.h"

namespace tagrid {
namespace {

/// The names of the temporaries that exist, for unlink_temporaries(). A file beyond the last slot is not
/// known to a signal handler, and works otherwise.
constexpr int slot_count = 64;
enum SlotState : int { slot_free, slot_filling, slot_used };
std::array<std::atomic<int>, slot_count> slot_states = {};
char slot_paths[slot_count][PATH_MAX];

int register_temporary(const std::string& path) {
  if (path.size() >= PATH_MAX) return -1;
  for (int slot = 0; slot < slot_count; ++slot) {
    int expected = slot_free;
    auto& state = slot_states[static_cast<std::size_t>(slot)];
    if (!state.compare_exchange_strong(expected, slot_filling)) continue;
    std::memcpy(slot_paths[slot], path.c_str(), path.size() + 1);
    state.store(slot_used);
    return slot;
  }
  return -1;
}

void forget_temporary(int slot) {
  if (slot >= 0) slot_states[static_cast<std::size_t>(slot)].store(slot_free);
}

std::string random_suffix() {
  constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyz012345";
  std::array<unsigned char, 6> random = {};
  if (getrandom(random.data(), random.size(), 0) != static_cast<ssize_t>(random.size()))
    for (auto& byte : random) byte = static_cast<unsigned char>(std::rand());
  std::string suffix;
  for (unsigned char byte : random) suffix += letters[byte % letters.size()];
  return suffix;
}

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

/// Writes straight to what is not a regular file, such as /dev/null or a named pipe.
bool is_special(const std::string& path) {
  struct stat status;
  return stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
}

UsageError exists_already(const std::string& path) {
  return UsageError(path + ": exists already; give -f to overwrite it");
}

/// Makes a name in a folder survive a crash of the machine. Some file systems cannot, which is no failure.
void sync_folder(const std::string& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  fsync(descriptor);
  close(descriptor);
}

/// Renames without overwriting; returns 0 or an errno.
int rename_to_new(const std::string& from, const std::string& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  if (link(from.c_str(), to.c_str()) != 0) return errno;
  unlink(from.c_str());
  return 0;
}

}  // namespace

void unlink_temporaries() noexcept {
  for (int slot = 0; slot < slot_count; ++slot)
    if (slot_states[static_cast<std::size_t>(slot)].load() == slot_used) unlink(slot_paths[slot]);
}

void check_output(const std::string& path, bool overwrite) {
  struct stat status;
  if (path == "-" || lstat(path.c_str(), &status) != 0 || is_special(path)) return;
  if (S_ISDIR(status.st_mode)) throw UsageError(path + ": is a folder; give the name of a file");
  if (!overwrite) throw exists_already(path);
}

OutputFile::OutputFile(const std::string& path, bool overwrite, const std::optional<FileAttributes>& like)
    : path_(path), name_(path == "-" ? "standard output" : path), overwrite_(overwrite), like_(like) {
  check_output(path, overwrite);
  if (path == "-") {
    descriptor_ = STDOUT_FILENO;
  } else if (is_special(path)) {
    descriptor_ = open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor_ < 0) throw world_error("cannot open", name_, errno);
  } else {
    create_temporary();
  }
}

OutputFile::~OutputFile() {
  if (!temporary_.empty()) unlink(temporary_.c_str());
  forget_temporary(slot_);
  if (descriptor_ >= 0 && descriptor_ != STDOUT_FILENO) close(descriptor_);
}

void OutputFile::create_temporary() {
  // The temporary's name is longer than the target's, which may be as long as names can be.
  const std::string file_name = std::filesystem::path(path_).filename().string();
  if (file_name.empty()) throw UsageError(path_ + ": is not the name of a file");
  std::string hidden_name = ".";
  hidden_name.append(file_name, 0, 240).append(".part");
  const std::string stem = (std::filesystem::path(path_).parent_path() / hidden_name).string();
  for (int attempt = 0; attempt < 100; ++attempt) {
    const std::string candidate = stem + random_suffix();
    // Registered first: a signal in between must not leave it. The mode is that of any new file, or nobody
    // else's until it is that of another one.
    slot_ = register_temporary(candidate);
    descriptor_ = open(candidate.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, like_ ? 0600 : 0666);
    if (descriptor_ >= 0) {
      temporary_ = candidate;
      if (like_) set_permissions(descriptor_, *like_);
      return;
    }
    const int error = errno;
    forget_temporary(slot_);
    slot_ = -1;
    if (error != EEXIST) throw world_error("cannot create", name_, error);
  }
  throw world_error("cannot create", name_, EEXIST);
}

void OutputFile::write(std::span<const std::byte> bytes) {
  assert(descriptor_ >= 0);
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor_, bytes.data(), std::min(bytes.size(), std::size_t{1} << 30));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EPIPE) throw ClosedPipe(name_ + ": nobody reads it any more");
    if (count < 0) throw world_error("cannot write", name_, errno);
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    position_ += static_cast<std::uint64_t>(count);
  }
}

void OutputFile::write_at(std::uint64_t position, std::span<const std::byte> bytes) {
  assert(!temporary_.empty());
  while (!bytes.empty()) {
    const ssize_t count = pwrite(descriptor_, bytes.data(), std::min(bytes.size(), std::size_t{1} << 30),
                                 static_cast<off_t>(position));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw world_error("cannot write", name_, errno);
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    position += static_cast<std::uint64_t>(count);
  }
}

void OutputFile::sync() {
  if (like_ && !temporary_.empty() && !synced_) {
    const timespec times[2] = {like_->accessed, like_->modified};
    // A time that cannot be kept is no reason to throw the file away.
    if (futimens(descriptor_, times) != 0) errno = 0;
  }
  if (!temporary_.empty() && !synced_ && fsync(descriptor_) != 0)
    throw world_error("cannot write", name_, errno);
  synced_ = true;
}

void OutputFile::close_descriptor() {
  const int descriptor = std::exchange(descriptor_, -1);
  if (descriptor == STDOUT_FILENO) return;
  // Network file systems report some failed writes only here.
  if (close(descriptor) != 0 && errno != EINTR) throw world_error("cannot write", name_, errno);
}

void OutputFile::give_name() {
  int error = 0;
  if (!overwrite_)
    error = rename_to_new(temporary_, path_);
  else if (rename(temporary_.c_str(), path_.c_str()) != 0)
    error = errno;
  if (error == EEXIST) throw exists_already(path_);
  if (error != 0) throw world_error("cannot rename the finished file to", name_, error);
  forget_temporary(std::exchange(slot_, -1));
  temporary_.clear();
  sync_folder(folder_of(path_));
}

void OutputFile::commit() {
  assert(descriptor_ >= 0);
  sync();
  close_descriptor();
  if (!temporary_.empty()) give_name();
}

}  // namespace tagrid
